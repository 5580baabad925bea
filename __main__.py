"""``python -m accelscope`` and the program ``accelscope``: the command line.

What it imports takes a sixth of a second, and nothing is lost if it is stopped meanwhile: so
Ctrl-C and a request to terminate end it with one line, before anything else is imported.
"""

import contextlib
import gc
import os
import signal
import sys
from types import FrameType


def stop(number: int, frame: FrameType | None) -> None:
    """End the process at once."""
    with contextlib.suppress(OSError):  # standard error may be closed
        os.write(2, b"accelscope: error: stopped\n")
    os._exit(2)


def main() -> int:
    """Run the command line; return its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        # Who has it ignored, such as nohup, has a reason.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)
    # Nothing that is imported is garbage: to look through all of it, again and again while there
    # comes more, takes an eighth of the start.
    gc.disable()
    from .addon.command.main import main as run

    gc.freeze()
    gc.enable()
    return run()


if __name__ == "__main__":
    sys.exit(main())
