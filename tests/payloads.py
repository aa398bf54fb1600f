"""Texts that would break a page, a figure, a spreadsheet or LaTeX if anything took them for more than text."""

from __future__ import annotations

PAYLOADS = (
    "<script>document.title='owned'</script>",
    "</script><script>document.title='owned'</script>",
    "</style><style>body{display:none}</style>",
    "</title><h1>owned</h1>",
    "<img src=x onerror=\"document.title='owned'\">",
    "<svg onload=\"document.title='owned'\"></svg>",
    "<iframe src='https://example.org/'></iframe>",
    "<link rel=stylesheet href='https://example.org/x.css'>",
    "<a href=\"javascript:document.title='owned'\">click</a>",
    "<meta http-equiv=refresh content='0;url=https://example.org/'>",
    "<base href='https://example.org/'>",
    "<details open ontoggle=\"document.title='owned'\">",
    '" onmouseover="document.title=\'owned\'" x="',
    "' autofocus onfocus='document.title=1' x='",
    "<!-- a comment that does not end",
    "]]> <![CDATA[ owned",
    "&lt;b&gt; &amp; &#60;i&#62;",
    "{{ 7 * 7 }} {% raw %} {# no #}",
    "${7*7} `x` ${{7*7}}",
    "$\\frac{1}{2}$ and an unclosed $\\frac{1",
    "\\input{/etc/passwd} \\\\ & % # _ ~ ^ { }",
    '=HYPERLINK("https://example.org/","click")',
    "@SUM(A1:A9), +1, -1, =1",
    "Fichte \"aus dem\" 'Tal', Ø 3 mm, 100 %",
    "a" * 300,
    "\U0001f3bb\U0001f332 violin \U0001f469\u200d\U0001f527",
    "\u202egnp.exe\u202c reversed",
    "\u200fלוח עץ\u200e spruce",
    "\u2066isolated\u2069 \u061cلوح",
    "日本の楓, 한국 가문비나무, Ελάτη",
)

EVERY = " ".join(one for one in PAYLOADS if len(one) < 300)
"""All of them at once: what `tests/results/test_tables.py` tries one by one, at the places that a page has."""

DIRECTION_MARKS = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f\u061c"


def shown(payload: str) -> str:
    """What should be seen of a payload: itself, without the marks that turn the direction of writing."""
    return "".join(character for character in payload if character not in DIRECTION_MARKS)
