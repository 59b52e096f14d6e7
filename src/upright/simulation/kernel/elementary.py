"""Elementary functions of the kernel's text: without branches, so that lanes stay vectors, and without a C library.

Each agrees with the exact value to within a few units in the last place; the tests say how many. A kernel holds the
sine and cosine that pendulums need and the decay that friction needs, and of the others what its text calls: nothing in
these is rearranged or fused, so that the same text has the same bits in C and in Python.
"""

from __future__ import annotations

import re

_SINCOS = '''
    """Sine and cosine; reduction by pi/2 in two parts, exact products up to 1e6 rad, then Cephes' polynomials."""
    n = floor(x * 0.63661977236758134308 + 0.5)
    r = (x - n * 1.57079632673412561417e00) - n * 6.07710050650619224932e-11
    z = r * r
    p = (((1.58962301576546568060e-10 * z - 2.50507477628578072866e-8) * z + 2.75573136213857245213e-6) * z
         - 1.98412698295895385996e-4)
    p = (p * z + 8.33333333332211858878e-3) * z - 1.66666666666666307295e-1
    sn = r + r * z * p
    p = (((-1.13585365213876817300e-11 * z + 2.08757008419747316778e-9) * z - 2.75573141792967388112e-7) * z
         + 2.48015872888517045348e-5)
    p = (p * z - 1.38888888888730564116e-3) * z + 4.16666666666665929218e-2
    cs = 1.0 - 0.5 * z + z * z * p
    h = n * 0.5
    odd = h - floor(h)
    h = n * 0.25
    quadrant = h - floor(h)
    a = cs if odd > 0.25 else sn
    b = sn if odd > 0.25 else cs
    return (-a if quadrant >= 0.5 else a), (-b if (quadrant > 0.125) & (quadrant < 0.625) else b)
'''

ALWAYS = f'''
@inline_strict
def sincos(x):{_SINCOS}

@inline_strict
def falling(x):
    """exp(-x) for x >= 0, by Cephes' rational function; 0 beyond 700."""
    y = 0.0 - (700.0 if x > 700.0 else x)
    n = floor(y * 1.4426950408889634 + 0.5)
    r = (y - n * 6.93145751953125e-1) - n * 1.42860682030941723212e-6
    z = r * r
    p = r * ((1.26177193074810590878e-4 * z + 3.02994407707441961300e-2) * z + 9.99999999999999999910e-1)
    q = ((3.00198505138664455042e-6 * z + 2.52448340349684104192e-3) * z + 2.27265548208155028766e-1) * z + 2.0
    e = ldexp(1.0 + 2.0 * p / (q - p), int(n))
    return 0.0 if x >= 700.0 else e
'''

_TEXTS = {
    "exact_sincos": f"""
@exact
def exact_sincos(x):{_SINCOS}""",
    "sin": """
@exact
def sin(x):
    sn, cs = exact_sincos(x)
    return sn
""",
    "cos": """
@exact
def cos(x):
    sn, cs = exact_sincos(x)
    return cs
""",
    "tan": """
@exact
def tan(x):
    sn, cs = exact_sincos(x)
    return sn / cs
""",
    "exp": """
@exact
def exp(x):
    # Cephes' rational function; scaled in two halves, so that it fades to 0 and grows to infinity bit by bit
    y = 800.0 if x > 800.0 else (-800.0 if x < -800.0 else x)
    n = floor(y * 1.4426950408889634 + 0.5)
    r = (y - n * 6.93145751953125e-1) - n * 1.42860682030941723212e-6
    z = r * r
    p = r * ((1.26177193074810590878e-4 * z + 3.02994407707441961300e-2) * z + 9.99999999999999999910e-1)
    q = ((3.00198505138664455042e-6 * z + 2.52448340349684104192e-3) * z + 2.27265548208155028766e-1) * z + 2.0
    h = floor(0.5 * n)
    return ldexp(ldexp(1.0 + 2.0 * p / (q - p), int(h)), int(n - h))
""",
    "log": """
@exact
def log(x):
    # fdlibm's: x = 2^n (1 + f) with 1 + f between sqrt(1/2) and sqrt(2), a series in f / (2 + f)
    m, n = frexp(x)
    low = m < 0.70710678118654752440
    k = float(n) - (1.0 if low else 0.0)
    f = (m + m if low else m) - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    r = w * (3.999999999940941908e-1 + w * (2.222219843214978396e-1 + w * 1.531383769920937332e-1))
    r = r + z * (6.666666666666735130e-1 + w * (2.857142874366239149e-1 + w * (1.818357216161805012e-1
                 + w * 1.479819860511658591e-1)))
    h = 0.5 * f * f
    y = k * 6.93147180369123816490e-1 - ((h - (s * (h + r) + k * 1.90821492927058770002e-10)) - f)
    outside = x if x > 0.0 else (-inf if x == 0.0 else nan)
    return y if (x > 0.0) & (x < inf) else outside
""",
    "sinh": """
@exact
def sinh(x):
    # Cephes'; infinite beyond 709
    z = x * x
    p = ((-7.89474443963537015605e-1 * z - 1.63725857525983828727e2) * z - 1.15614435765005216044e4) * z
    q = ((z - 2.77711081420602794433e2) * z + 3.61578279834431989373e4) * z - 2.11052978884890840399e6
    near = x + x * z * ((p - 3.51754964808151394800e5) / q)
    a = abs(x)
    e = exp(a)
    far = 0.5 * e - 0.5 / e
    return near if a < 1.0 else (-far if x < 0.0 else far)
""",
    "cosh": """
@exact
def cosh(x):
    e = exp(abs(x))
    return 0.5 * e + 0.5 / e
""",
    "tanh": """
@exact
def tanh(x):
    # Cephes'
    z = x * x
    p = (-9.64399179425052238628e-1 * z - 9.92877231001918586564e1) * z - 1.61468768441708447952e3
    q = ((z + 1.12811678491632931402e2) * z + 2.23548839060100448583e3) * z + 4.84406305325125486048e3
    near = x + x * z * (p / q)
    a = abs(x)
    far = 1.0 - 2.0 / (exp(a + a) + 1.0)
    return near if a < 0.625 else (-far if x < 0.0 else far)
""",
    "atan": """
@exact
def atan(x):
    # Cephes': about 0, pi/4 or pi/2, each of the latter in two parts
    a = abs(x)
    far, near = a > 2.41421356237309504880, a < 0.66
    r = (-1.0 if far else (a if near else a - 1.0)) / (a if far else (1.0 if near else a + 1.0))
    z = r * r
    p = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z
         - 1.228866684490136173410e2)
    p = (p * z - 6.485021904942025371773e1) * z
    q = (((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2) * z
    q = (q + 4.853903996359136964868e2) * z + 1.945506571482613964425e2
    y = r + (r * (p / q) + (6.123233995736765886130e-17 if far else (0.0 if near else 3.061616997868382943065e-17)))
    y = y + (1.57079632679489661923 if far else (0.0 if near else 0.785398163397448309616))
    return -y if x < 0.0 else y
""",
    "asin": """
@exact
def asin(x):
    return 2.0 * atan(x / (1.0 + sqrt((1.0 - x) * (1.0 + x))))
""",
    "acos": """
@exact
def acos(x):
    a = abs(x)
    y = 2.0 * atan(sqrt((1.0 - a) / (1.0 + a)))
    return 3.14159265358979323846 - y if x < 0.0 else y
""",
    "atan2": """
@exact
def atan2(y, x):
    a, b = abs(y), abs(x)
    steep = a > b
    small, large = (b if steep else a), (a if steep else b)
    r = atan(small / large if large > 0.0 else 0.0 * large)
    r = 1.57079632679489661923 - r if steep else r
    r = 3.14159265358979323846 - r if x < 0.0 else r
    return -r if y < 0.0 else r
""",
}  # fmt: skip

NAMES = frozenset(_TEXTS) - {"exact_sincos"}
"""Functions that a text may call."""


def definitions(*texts: str) -> str:
    """Definitions of what these texts call, each before those that call it."""
    distinct: list[str] = []

    def visit(text: str) -> None:
        for name in sorted(_TEXTS.keys() & set(re.findall(r"\b([a-z]\w*)\(", text))):
            if _TEXTS[name] not in distinct and _TEXTS[name] != text:
                visit(_TEXTS[name])
                distinct.append(_TEXTS[name])

    for text in texts:
        visit(text)
    return "\n".join(distinct)
