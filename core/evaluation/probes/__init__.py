"""Probes by name: what a picture of generalized rays is made with, one file each."""
