"""What the library says of its arguments, in the words of the command line: ``up='z'`` as ``--up=z``.

The library speaks to those who call it; whoever typed a command can type options alone.
"""

from __future__ import annotations

import re
import shlex

_START = r"(?<![-\w/\\.])"  # not inside an option, a word, or the path of a file
_ROLES = re.compile(_START + r"(?:read_bvh\(path, )?roles=\{'(\w+)': 'NAME'[^}]*\}\)?")
_VALUE = re.compile(
    _START + r"(units|up|root|rigid|animation|root_motion)="
    r"""('[^']*'|"[^"]*"|\d+(?:\.\d+)?(?:e-?\d+)?)"""
)
_SWITCH = re.compile(_START + r"(tpose_first|drop_zeros|skip_bad)=(True|False)")
_BARE = re.compile(
    _START + r"(units|up|root|rigid|animation|skeleton|reference|by_file|fps|like|roles)="
    r"(?!motionlab)(?=(\w)?)"
)


def as_options(text: str, rate: str = "--file-fps") -> str:
    """What is said of arguments, as ``up='z'``, in the words of the command line: ``--up=z``.

    rate : the option that stands for ``fps=``, the rate at which files are read.
    """
    text = _ROLES.sub(r'--roles=rig.toml (a file with lines such as \1 = "NAME")', text)
    text = _VALUE.sub(lambda m: f"{_option(m[1])}={shlex.quote(m[2].strip(_quote(m[2])))}", text)
    text = _SWITCH.sub(lambda m: f"--{'no-' * (m[2] == 'False')}{_option(m[1])[2:]}", text)
    text = _BARE.sub(
        lambda m: (rate if m[1] == "fps" else _option(m[1])) + "=" * (m[2] is not None), text
    )
    # which a command is told of a rig has options of its own
    return text.replace("--roles", "--rig-roles") if "target skeleton" in text else text


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def _quote(value: str) -> str:
    return value[0] if value[0] in "'\"" else ""
