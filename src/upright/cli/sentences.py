"""How does the tool say that something went wrong? In one sentence on stderr, and by its exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager

import typer

from upright.errors import UprightError

USER_ERROR, BUG, INTERRUPTED = 2, 1, 130


@contextmanager
def sentences() -> Generator[None]:
    """Turn errors into one sentence on stderr and an exit code; `UPRIGHT_DEBUG=1` shows the traceback."""
    try:
        yield
    except KeyboardInterrupt:
        raise _stop("stopped by Ctrl-C; what was already written is kept.", INTERRUPTED) from None
    except BrokenPipeError:  # `upright show LOG | head`: the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(0) from None
    except UprightError as error:
        _debug()
        raise _stop(str(error), USER_ERROR) from None
    except OSError as error:
        _debug()
        raise _stop(_about_file(error), USER_ERROR) from None
    except MemoryError:
        _debug()
        raise _stop("not enough memory for this input; try a shorter time window or fewer runs.", USER_ERROR) from None
    except Exception as error:
        _debug()
        if isinstance(error, typer.Exit | typer.Abort) or hasattr(error, "exit_code"):
            raise  # typer's own: usage errors and requested exits
        where = f"{type(error).__name__}: {error}".rstrip(": ")
        raise _stop(f"this is a bug in upright ({where}); UPRIGHT_DEBUG=1 shows where it happened.", BUG) from None


def only_sentences() -> None:
    """Keep the remarks of libraries off the terminal, unless somebody asks for them."""
    import logging
    import warnings

    if os.environ.get("UPRIGHT_DEBUG", "0") in ("", "0") and not sys.warnoptions:
        warnings.simplefilter("ignore")
        logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # says what is wrong with a user's matplotlibrc


def _debug() -> None:
    if os.environ.get("UPRIGHT_DEBUG", "0") not in ("", "0"):
        raise  # what the caller is handling


def _stop(sentence: str, code: int) -> typer.Exit:
    typer.echo(f"upright: {' '.join(sentence.split())}", err=True)
    return typer.Exit(code)


def _about_file(error: OSError) -> str:
    name = f"'{error.filename}'" if error.filename is not None else "a file"
    if isinstance(error, FileNotFoundError):
        return f"{name} was not found; check the spelling and the folder it is looked for in."
    if isinstance(error, IsADirectoryError):
        return f"{name} is a folder, a file is needed; name the file inside it."
    if isinstance(error, NotADirectoryError | FileExistsError):
        return f"a folder is needed where {name} is a file; choose another place with -o."
    if isinstance(error, PermissionError):
        return f"{name} may not be read or written by you; check its permissions or choose another place with -o."
    return f"{name} could not be used: {error.strerror or error}; check the disk and the path."
