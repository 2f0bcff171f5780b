"""A process that has done the imports of the command line and forks one for each run of it.

`runner` starts it with the number of a Unix socket. A request is one message: the arguments, the
environment and the working directory, with the descriptors of the three standard streams. Two
messages answer it: the number of the forked process, and the status with which that ended.
"""

import atexit
import gc
import io
import json
import os
import runpy
import signal
import socket
import sys
from importlib import import_module

# Of mdfconv itself only what every run imports: a command shows whether its own imports suffice.
IMPORTS = (
    "matplotlib.backends.backend_agg",
    "matplotlib.figure",
    "mdfconv.cli",
    "numpy",
    "PIL.PngImagePlugin",
    "rich.progress",
    "rich.table",
    "scipy.optimize",
    "scipy.special",
    "typer.rich_utils",
)
LARGEST_REQUEST = 1 << 20


def main():
    """Serve until the runner closes its socket; in a forked process, run the command line."""
    for name in IMPORTS:
        import_module(name)
    # Forked processes share the pages of objects that no collection of garbage visits.
    gc.freeze()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with socket.socket(fileno=int(sys.argv[1])) as control:
        request, descriptors = serve(control)
    if request is not None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        become(descriptors=descriptors, **request)
        run_to_the_end()


def serve(control):
    """Fork for each request; return it in the forked process, and None after the last one."""
    while True:
        message, descriptors, *_ = socket.recv_fds(control, LARGEST_REQUEST, 3)
        if not message:
            return None, []
        process = os.fork()
        if process == 0:
            return json.loads(message), descriptors
        for descriptor in descriptors:
            os.close(descriptor)
        control.send(b"%d" % process)
        _, status = os.waitpid(process, 0)
        control.send(b"%d" % os.waitstatus_to_exitcode(status))


def become(arguments, environment, cwd, descriptors):
    """Make this process what a new interpreter would be with these arguments and streams."""
    for number, descriptor in enumerate(descriptors):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    sys.path[0] = os.getcwd()
    sys.argv[1:] = arguments
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = standard_stream(number, name, environment.get("PYTHONIOENCODING", ""))
        setattr(sys, name, stream)
        setattr(sys, f"__{name}__", stream)


def standard_stream(number, name, wanted):
    """Return a descriptor as the text stream that a new interpreter makes of it."""
    encoding, _, errors = wanted.partition(":")
    # The streams of the server show what the interpreter takes by itself.
    usual = getattr(sys, name)
    if name == "stderr" or not wanted:
        errors = usual.errors
    return io.TextIOWrapper(
        open(number, "rb" if name == "stdin" else "wb", closefd=False),
        encoding or usual.encoding,
        errors or "strict",
        newline="\n",
        line_buffering=name == "stderr" or os.isatty(number),
    )


def run_to_the_end():
    """Run the command line and end as an interpreter does.

    Freeing memory would take an interpreter longer than most runs: the common end does without.
    """
    try:
        runpy.run_module("mdfconv", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if not isinstance(end.code, int | None):
            raise
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(end.code or 0)


if __name__ == "__main__":
    main()
