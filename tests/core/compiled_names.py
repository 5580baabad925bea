"""For programs that tests run in processes of their own: what is compiled there."""

COMPILED = """
from numba.core import event
compiled = []

class Listener(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
"""
"""Fills the list `compiled` with the names of kernels that were not found on disk."""
