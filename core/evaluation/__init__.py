"""Metrics, workloads (named ray sets), experiments, records, reports and pictures."""
