"""Scripts without comments, blanks and long names, so that no other tool is needed to write a page.

Not for any script, but for those of this package: statements end with a semicolon, comments have
lines of their own, and quotes are ``"`` or `` ` ``.
"""

import re
from collections import Counter
from itertools import product
from string import ascii_letters

_COMMENTS = re.compile(r"^\s*//.*$", re.MULTILINE)
# Texts, and in templates the code between texts; regular expressions stand after ( or =.
_TOKENS = re.compile(r'''"(?:\\.|[^"\\])*" | `|(?<=[(=,])\s*/(?![/*\s])(?:\\.|\[[^]]*\]|[^/\\\n])+/
                     | \#?[A-Za-z_$][\w$]* | \d[\w.]* | \s+ | \?\. | => | \.\.\. | .''', re.VERBOSE)
_NAME = re.compile(r"#?[A-Za-z_$][\w$]*\Z")
# Beside these letters no blank matters.
_CLOSED = set("{}()[];,:?=*/<>&|!%.`")
_SHORTER = tuple((re.compile(pattern), instead) for pattern, instead in (
    (r"\bconst\b", "let"), (r";}", "}"), (r"\((\w+)\)=>", r"\1=>"),
    (r"(?<![\w.$])0\.(?=\d)", "."), (r"\btrue\b", "!0"), (r"\bfalse\b", "!1")))
# Constants of WebGL as its standard fixes them.
_OF_WEBGL = {
    "ARRAY_BUFFER": 34962, "BLEND": 3042, "CLAMP_TO_EDGE": 33071, "COLOR_BUFFER_BIT": 16384,
    "DEPTH_BUFFER_BIT": 256, "DEPTH_TEST": 2929, "DYNAMIC_DRAW": 35048,
    "ELEMENT_ARRAY_BUFFER": 34963, "FLOAT": 5126, "FRAGMENT_SHADER": 35632, "LINEAR": 9729,
    "LINES": 1, "ONE": 1, "ONE_MINUS_SRC_ALPHA": 771, "POLYGON_OFFSET_FILL": 32823, "RGBA": 6408,
    "SRC_ALPHA": 770, "STATIC_DRAW": 35044, "TEXTURE_2D": 3553, "TEXTURE_MIN_FILTER": 10241,
    "TEXTURE_WRAP_S": 10242, "TRIANGLES": 4, "UNSIGNED_BYTE": 5121, "UNSIGNED_INT": 5125,
    "VERTEX_SHADER": 35633}
_GL = re.compile(rf"\bgl\.({'|'.join(_OF_WEBGL)})\b")
_WORDS = frozenset(
    """async await break case catch class const constructor continue default delete do else
    export extends false finally for from function get if import in instanceof let new null
    of return set static super switch this throw true try typeof undefined void while""".split())  # noqa: SIM905
_BEFORE_OBJECTS = ("const", "let", "return", "default")
_GLOBALS = frozenset(
    """Array Blob CSSStyleSheet DataView DecompressionStream Float32Array Float64Array
    ImageData Infinity JSON Map Math NaN Number Object Path2D Promise ResizeObserver
    Response Set TextDecoder TextEncoder Uint32Array Uint8Array clearTimeout console
    devicePixelRatio document getComputedStyle innerHeight matchMedia parseInt performance
    requestAnimationFrame setTimeout window""".split())  # noqa: SIM905
_ALIKE = frozenset(
    """Float32Array Float64Array Math Path2D Uint32Array Uint8Array document performance
    requestAnimationFrame setTimeout window""".split())  # noqa: SIM905


def shortened(text: str) -> str:
    """A script that does the same in fewer letters."""
    plain = _GL.sub(lambda match: str(_OF_WEBGL[match[1]]), _COMMENTS.sub("", text))
    tokens = _tokens(plain)
    roles = _roles(tokens)
    names = _new_names(tokens, roles)
    found = []
    for (kind, token), role in zip(tokens, roles, strict=True):
        if role == "plain":
            found.append((kind, names.get(token, token)))
        elif role == "short" and token in names:
            found.append((kind, f"{token}:{names[token]}"))
        else:
            found.append((kind, token))
    # Globals that never change and are used often.
    globals_ = ",".join(f"{names[name]}={name}" for name in sorted(_ALIKE & names.keys()))
    return (f"let {globals_};" if globals_ else "") + _joined(_together(found))


def _tokens(text: str) -> list[tuple[str, str]]:
    """Kinds and letters: 'text' is kept, 'name' may be renamed, 'blank' may go."""
    found: list[tuple[str, str]] = []
    depths: list[int] = []  # of braces within each ${ } that is open
    at = 0
    while at < len(text):
        match = _TOKENS.match(text, at)
        assert match is not None
        token, at = match.group(), match.end()
        if token == "{" and depths:
            depths[-1] += 1
        if token == "}" and depths:
            depths[-1] -= 1
        if token == "`" or (token == "}" and depths and depths[-1] < 0):
            if token == "}":
                depths.pop()
            end = re.compile(r"(?:\\.|[^`\\$]|\$(?!\{))*(`|\$\{)", re.DOTALL).match(text, at)
            assert end is not None
            token, at = token + end.group(), end.end()
            if end.group(1) == "${":
                depths.append(0)
            found.append(("text", token))
        elif token.isspace():
            found.append(("blank", "\n" if "\n" in token else " "))
        elif _NAME.match(token):
            found.append(("name", token))
        else:
            found.append(("text" if len(token) > 3 or token[0] == '"' else "sign", token))
    return found


def _roles(tokens: list[tuple[str, str]]) -> list[str]:
    """Role of each token: 'property', 'short' for a property with its value, or 'plain'."""
    places = [place for place, (kind, _) in enumerate(tokens) if kind != "blank"]
    code, roles, brackets = [tokens[place] for place in places], [""] * len(tokens), [""]
    for at, (kind, token) in enumerate(code):
        before = code[at - 1][1] if at else ""
        after = code[at + 1][1] if at + 1 < len(code) else ""
        if kind == "sign" and token in "([{":
            block = token == "{" and at and (before in (")", "=>", ";", "}", "{") or (
                code[at - 1][0] == "name" and before not in _BEFORE_OBJECTS))
            brackets.append("block" if block else token)
        elif kind == "sign" and token in ")]}":
            brackets.pop()
        if kind != "name":
            continue
        if token[0] == "#":
            roles[places[at]] = "plain"
            continue
        first = brackets[-1] == "{" and before in ("{", ",")
        if before in (".", "?.") or (first and after == ":") or (
                brackets[-1] in ("{", "block") and after == "(" and _is_method(code, at + 1)):
            roles[places[at]] = "property"
        else:
            roles[places[at]] = "short" if first and after in ("}", ",", "=") else "plain"
    return roles


def _new_names(tokens: list[tuple[str, str]], roles: list[str]) -> dict[str, str]:
    """Short names for those that are not global, the most frequent ones first.

    A name stands for one thing or several in the whole script, and is replaced everywhere.
    """
    used = {token for kind, token in tokens if kind == "name"}
    saved = Counter[str]()
    for (_, token), role in zip(tokens, roles, strict=True):
        if role in ("plain", "short"):
            saved[token] += len(token) - 2 if role == "plain" else -3
    for name in _ALIKE & saved.keys():
        saved[name] -= len(name) + 4
    ours = [name for name, letters in saved.items()
            if letters > 0 and name not in _WORDS and name not in _GLOBALS - _ALIKE]
    fresh = (name for length in (1, 2) for name in map("".join, product(ascii_letters,
                                                                        repeat=length))
             if name not in used and name not in _WORDS)
    ours.sort(key=lambda name: (-saved[name], name))
    private = [name for name in ours if name[0] == "#"]
    return dict(zip([name for name in ours if name[0] != "#"], fresh, strict=False)) | {
        name: "#" + short for name, short in zip(private, ascii_letters, strict=False)}


def _together(tokens: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Declarations that follow each other as one."""
    found: list[tuple[str, str]] = []
    declares, begins = [False], True  # the statement at each depth; whether one begins here
    at = 0
    while at < len(tokens):
        kind, token = tokens[at]
        at += 1
        found.append((kind, token))
        if kind == "blank":
            continue
        if begins:
            declares[-1] = token in ("const", "let")
        begins = kind == "sign" and token in ";{}"
        if kind != "sign":
            continue
        if token in "([{":
            declares.append(False)
        elif token in ")]}":
            declares.pop()
            # A block's closing brace does not belong to a declaration; an object's may end one.
            begins = token == "}" and not declares[-1]
        elif token == ";" and declares[-1]:
            ahead = next((k for k in range(at, len(tokens)) if tokens[k][0] != "blank"), at)
            if ahead < len(tokens) and tokens[ahead][1] in ("const", "let"):
                found[-1] = ("sign", ",")
                begins, at = False, ahead + 1
                while at < len(tokens) and tokens[at][0] == "blank":
                    at += 1
    return found


def _is_method(code: list[tuple[str, str]], at: int) -> bool:
    """True if a body follows the bracket that opens at a place."""
    depth = 0
    while at < len(code):
        if code[at][0] == "sign":
            depth += (code[at][1] in "([{") - (code[at][1] in ")]}")
        at += 1
        if not depth:
            break
    return at < len(code) and code[at][1] == "{"


def _joined(tokens: list[tuple[str, str]]) -> str:
    found: list[str] = []
    for at, (kind, token) in enumerate(tokens):
        if kind == "blank" and found and at + 1 < len(tokens):
            before, after = found[-1][-1], tokens[at + 1][1][0]
            # A + or a - may meet another.
            if before in _CLOSED or after in _CLOSED or (
                    {before, after} & set("+-") and not {before, after} <= set("+-")):
                continue
        found.append(token)
    parts: list[str] = []
    for part in re.split(r'("(?:\\.|[^"\\])*"|`(?:\\.|[^`\\])*`)', "".join(found).strip()):
        code = part
        for pattern, instead in _SHORTER if part[:1] not in ("", '"', "`") else ():
            code = pattern.sub(instead, code)
        if part.startswith("`#version"):  # a shader, whose first line is one of its own
            first, _, rest = code.partition("\n")
            code = first + "\n" + re.sub(r"\s*([{}(),;=+*/<>?:-])\s*", r"\1", rest)
        parts.append(code)
    return "".join(parts)
