"""Start of Warp without its warning on stderr if there is no GPU."""

import os

import warp as wp


def _start_quietly() -> None:
    wp.config.log_level = wp.LOG_ERROR
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


_start_quietly()
