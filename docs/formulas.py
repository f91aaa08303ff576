"""Formulas as MathML, which browsers draw by themselves, without a network."""

from __future__ import annotations

import re
from xml.etree import ElementTree as Xml

from docutils.utils.math.latex2mathml import tex2mathml

MATHML = "{http://www.w3.org/1998/Math/MathML}"
ACCENTS = {"ˉ", "˙", "^", "~"}
NAMED = re.compile(r"<mi>(\w+)</mi>\s*<mo>&ApplyFunction;</mo>(\s*<mo[^>]*>\()?")

Xml.register_namespace("", MATHML[1:-1])


def mathml(tex: str, block: bool) -> str:
    """Return a formula as MathML.

    Docutils leaves no space around named functions, and puts the index of an accented symbol
    below it, as that of a sum.
    """
    found = NAMED.sub(_function, tex2mathml(tex, as_block=block))
    whole = Xml.fromstring(found)
    for both in whole.iter(f"{MATHML}munderover"):
        base, index, accent = both
        if accent.text in ACCENTS:
            over = Xml.Element(f"{MATHML}mover")
            over.extend([base, accent])
            both.tag = f"{MATHML}msub"
            both[:] = [over, index]
    return Xml.tostring(whole, encoding="unicode")


def _function(match: re.Match[str]) -> str:
    name, bracket = match.groups()
    after = 0.0 if bracket else 0.17
    return f'<mo lspace="0.17em" rspace="{after}em">{name}</mo>{bracket or ""}'
