"""The program bvhscope: its window, and the rows of its commands."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from typing import Any


def program() -> str:
    """The program: what ``BVHSCOPE_PROGRAM`` names, otherwise ``bvhscope`` in the path."""
    named = os.environ.get("BVHSCOPE_PROGRAM")
    found = shutil.which(named or "bvhscope")
    if found is None:
        where = f"{named}, which BVHSCOPE_PROGRAM names, is no program" if named else "the program bvhscope is not in the path"
        raise FileNotFoundError(f"{where}: install it, or set BVHSCOPE_PROGRAM to where it is")
    return found


def measure(command: str, *arguments: str | os.PathLike[str], **options: Any) -> list[dict[str, Any]]:
    """Run a measuring command of the program bvhscope and return its rows, ready for ``pandas.DataFrame``.

    The program must be in the path, or named by the environment variable ``BVHSCOPE_PROGRAM``. ``docs/fields.md`` of the repository
    describes each field; ``bvhscope help COMMAND`` the options.

    Parameters
    ----------
    command : str
        "bench", "sweep", "compare", "info" or another command with ``--json``.
    *arguments : str or path
        Models and other arguments of the command.
    **options
        Its options, with ``_`` for ``-``: True for an option without value, a list or tuple for values with commas. Those that are None
        or False are left out.

    Returns
    -------
    list of dict
        The rows that the command prints with ``--json``.

    Raises
    ------
    FileNotFoundError
        Where the program is not found.
    ValueError
        Where the command fails: what it says.
    KeyboardInterrupt
        After Ctrl-C, which ends the program as well.

    Examples
    --------
    >>> import bvhscope
    >>> rows = bvhscope.measure("compare", "bunny.obj", rays=["primary", "ao"])  # doctest: +SKIP
    >>> pandas.DataFrame(rows)  # doctest: +SKIP
    """
    line = [program(), command, *(os.fspath(argument) for argument in arguments), "--json"]
    for name, value in options.items():
        if value is None or value is False:
            continue
        flag = "--" + name.replace("_", "-")
        text = ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
        line.append(flag if value is True else f"{flag}={text}")
    ran = subprocess.run(line, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", check=False)
    if ran.returncode != 0:
        lines = ran.stderr.strip().splitlines()
        raise ValueError(lines[-1] if lines else f"bvhscope {command} ended with code {ran.returncode}")
    rows, rest = [], ran.stdout.strip()
    while rest:
        row, end = json.JSONDecoder().raw_decode(rest)
        rows.append(row)
        rest = rest[end:].lstrip()
    return rows
