"""What to write in place of a line at which the TOML reader stopped."""

from __future__ import annotations

import re

from bayesplate.board.values import two_readings

_COMMA = re.compile(r"=\s*([+-]?[0-9]+,[0-9]+)")
_COMMA_IN_LIST = re.compile(r"[\[,]\s*[0-9]+,0[0-9]")  # TOML has no numbers like 05
_LABEL = re.compile(r"(\(\s*[0-9]+\s*,\s*[0-9]+\s*\))\s*(?:=\s*(.+))?")
_CURLY = re.compile("[\u201c\u201d\u201e\u2018\u2019\u201a\u00ab\u00bb]")


def syntax_remedy(line: str, file: str, *, is_twice: bool) -> str:
    """What to write instead; empty if the line does not tell what was meant.

    Parameters
    ----------
    line : str
    file : str
        The file's name.
    is_twice : bool
        Whether the line repeats a key or a table.
    """
    if is_twice:
        setup = re.match(r"\[\s*setup\b", line)
        return "several setups are written [[setup]], in double brackets, each with a name" if setup else ""
    if _CURLY.search(line):
        straight = _CURLY.sub('"', line)
        return f"straight quotes: {straight[:80]}"
    label = _LABEL.match(line)
    if label:
        return f'a label stands in quotes: "{label[1]}" = {(label[2] or "52")[:40]}'
    comma = _COMMA.search(line)
    if comma or _COMMA_IN_LIST.search(line):
        return (two_readings(comma[1]) if comma else "") or "a number has a decimal point, not a comma"
    if re.search(r"=\s*[+-]?[0-9.]+\s*[A-Za-z]", line):
        return "the unit stands in the key: write the number alone"
    if re.fullmatch(r"[^=\[#{]*[,;\t][^=]*", line) or not file.endswith(".toml"):
        return "a card is a TOML file with lines like length_x_mm = 550; bayesplate new writes a first one"
    if re.fullmatch(r"[^=]*=\s*", line):
        return "a value after the sign, or leave the line out"
    return "a text stands in quotes" if re.search(r"=\s*[^\W\d]", line) else ""
