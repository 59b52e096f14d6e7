"""Is the C of a kernel's text that which the text says, with whole numbers long and all others double?"""

from __future__ import annotations

import pytest

from upright.exports.fmu.translation import as_c, helpers


def body(*lines, arguments="n, X", arrays=None, sizes=None):
    """C of the statements of one function, its head and declarations left out."""
    text = f"def run({arguments}):\n" + "".join(f"    {line}\n" for line in lines)
    arrays = arrays if arrays is not None else {"X": ("double *", (1,))}
    written = as_c(text, "run", arrays, sizes or {}).splitlines()
    return [line.strip() for line in written[2:-1] if not line.strip().startswith(("long ", "double ", "(void)"))]


@pytest.mark.parametrize(
    ("line", "c"),
    [
        ("X[0] = n / 2", "X[0] = ((double)n / 2);"),  # whole numbers divide to a fraction
        ("X[0] = X[1] / 2", "X[0] = (X[1] / 2);"),
        ("X[0] = n // 2", "X[0] = quotient_l(n, 2);"),
        ("X[0] = X[1] // 2", "X[0] = floor((double)X[1] / 2);"),
        ("X[0] = n % 3", "X[0] = rest_l(n, 3);"),
        ("X[0] = X[1] % 3", "X[0] = rest_d(X[1], 3);"),
        ("X[0] = X[1] ** 2", "X[0] = power_d(X[1], 2);"),
        ("X[0] = X[1] ** 0.5", "X[0] = pow(X[1], 0.5);"),
        ("X[0] = X[1] ** 0", "X[0] = pow(X[1], 0);"),
        ("X[0] = -X[1]", "X[0] = (-X[1]);"),
        ("X[0] += 2.0", "X[0] = (X[0] + 2.0);"),
        ("X[0] = abs(n)", "X[0] = labs(n);"),
        ("X[0] = abs(X[1])", "X[0] = fabs(X[1]);"),
        ("X[0] = min(n, 2)", "X[0] = least_l(n, 2);"),
        ("X[0] = max(n, 2.0)", "X[0] = most_d(n, 2.0);"),
        ("X[0] = min(X[1], n)", "X[0] = least_d(X[1], n);"),
        ("X[0] = round(X[1])", "X[0] = round_l(X[1]);"),
        ("X[0] = int(X[1])", "X[0] = (long)(X[1]);"),
        ("X[0] = float(n)", "X[0] = (double)(n);"),
        ("X[0] = sin(n)", "X[0] = sin((double)n);"),
        ("X[0] = ldexp(X[1], n)", "X[0] = ldexp(X[1], n);"),
        ("X[0] = pi", "X[0] = 3.141592653589793;"),
        ("X[0] = True", "X[0] = 1;"),
        ("X[0] = X[1] if n < 2 else 3.0", "X[0] = ((n < 2) ? X[1] : 3.0);"),
        ("X[0] = 1.0 < X[1] <= 2.0", "X[0] = ((1.0 < X[1]) && (X[1] <= 2.0));"),
        ("X[0] = n == 1 or n > 3 and not n", "X[0] = ((n == 1) || ((n > 3) && (!n)));"),
        ("X[n + 1] = 0.5", "X[(n + 1)] = 0.5;"),
        ("if n: return", "if (n) {"),
        ("if not n: return", "if (!n) {"),
        ("if n < 2: return", "if (n < 2) {"),
        ("if float(n): return", "if ((double)(n)) {"),
        ("if abs(n): return", "if (labs(n)) {"),
        ("if (n > 1) == (n > 2): return", "if ((n > 1) == (n > 2)) {"),
        ("while n > 0: n -= 1", "while (n > 0) {"),
        ("for i in range(n): X[i] = 0.0", "for (i = 0; i < n; i++) {"),
        ("for i in range(2, n): X[i] = 0.0", "for (i = 2; i < n; i++) {"),
    ],
)
def test_a_statement_says_in_c_what_it_says_in_the_kernel(line, c):
    assert body(line)[0] == c


def test_rows_of_an_array_lie_behind_each_other():
    given = {"A": ("double *", (6, 1)), "B": ("long *", (1,))}
    assert body("A[n, 2] = B[n]", arguments="n, A, B", arrays=given) == ["A[6 * n + 2] = B[n];"]
    assert body("k = A.shape[0] + B.size", arguments="n, A, B", arrays=given, sizes={"A": "LANES", "B": "SAMPLES"}) == [
        "k = (LANES + SAMPLES);"
    ]
    assert body("A[:] = 0.0", arguments="n, A, B", arrays=given, sizes={"A": "12"}) == [
        "memset(A, 0, sizeof(double) * 12);"
    ]


def test_branches_and_loops_close_in_their_order():
    lines = ["if n > 1:", "    n = 1", "else:", "    n = 2", "for i in range(3):", "    if i > n:", "        break"]
    assert body(*lines) == [
        "if (n > 1) {", "n = 1;", "} else {", "n = 2;", "}", "for (i = 0; i < 3; i++) {", "if (i > n) {",
        "break;", "}", "}",
    ]  # fmt: skip


def test_each_block_stands_four_blanks_further_in():
    written = as_c("def run(n):\n    if n > 1:\n        while n > 2:\n            n -= 1\n    n = 3\n", "run", {}, {})
    assert written.splitlines()[2:] == [
        "    if (n > 1) {", "        while (n > 2) {", "            n = (n - 1);", "        }", "    }",
        "    n = 3;", "}",
    ]  # fmt: skip


def test_several_values_go_through_a_place_of_their_own_so_that_they_can_be_swapped():
    assert body("a, b = 1, 2.5", "b, c = b, a") == [
        "{", "const double several_1[2] = {1, 2.5};", "a = (long)several_1[0];", "b = several_1[1];", "}",
        "{", "const double several_2[2] = {b, a};", "b = several_2[0];", "c = (long)several_2[1];", "}",
    ]  # fmt: skip


def test_a_function_that_returns_several_writes_them_where_its_caller_reads_them():
    text = (
        "def pair(x, n):\n    return x * n, n\n\ndef unused(x):\n    return x\n\n"
        "def half(x):\n    return x / 2\n\ndef count(n):\n    return n + 1\n\n"
        "def run(n, X):\n    a, b = pair(X[0], n)\n    X[1] = half(a)\n    m = count(n)\n    X[2] = m\n"
    )
    written = as_c(text, "run", {"X": ("double *", (1,))}, {})
    heads = [line for line in written.splitlines() if line.startswith("static")]
    # each behind those that it calls, and none that nobody calls
    assert heads == [
        "static void k_pair(double x, long n, double *result_)", "static double k_half(double x)",
        "static long k_count(long n)", "static void k_run(long n, double *X)",
    ]  # fmt: skip
    for line in ("result_[0] = (x * n);", "result_[1] = n;", "k_pair(X[0], n, several_1);", "double several_1[2];",
                 "X[1] = k_half(a);", "m = k_count(n);", "return (n + 1);"):  # fmt: skip
        assert f"    {line}\n" in written
    assert "    long m = 0;\n    double a = 0, b = 0;\n" in written


def test_a_name_that_once_holds_a_fraction_is_double_throughout():
    text = "def run(n):\n    a = 1\n    b = a\n    c = n\n    a = a + 0.5\n"
    assert "    long c = 0;\n    double a = 0, b = 0;\n" in as_c(text, "run", {}, {})


def test_what_nobody_reads_is_told_to_the_compiler_and_names_of_c_are_evaded():
    written = as_c("def run(_dt, double, n):\n    _t = double\n", "run", {}, {})
    assert "k_run(double dt_, long double_, long n)" in written
    assert "    (void)dt_;\n    (void)n;\n    (void)t_;\n    t_ = double_;\n" in written
    assert "(void)double_" not in written


def test_only_the_helpers_that_a_text_calls_are_written():
    assert helpers("x = 1;") == ""
    assert helpers("x = least_l(1, 2);").count("static") == 1
    assert "static double power_d" in helpers("y = power_d(x, 2);")
    assert "round_l" in helpers("round_l(x)")
