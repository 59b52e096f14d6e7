/* Small functions by which C does as the kernel does: the first of two unless the second is better, whole quotients
   towards minus infinity, halves rounded to even, whole powers by products, frexp with both its results. */

static long least_l(long a, long b) { return b < a ? b : a; }

static long most_l(long a, long b) { return b > a ? b : a; }

static double least_d(double a, double b) { return b < a ? b : a; }

static double most_d(double a, double b) { return b > a ? b : a; }

static long quotient_l(long a, long b) { return b ? a / b - (a % b && (a < 0) != (b < 0)) : 0; }

static long rest_l(long a, long b) { return b ? a % b + (a % b && (a < 0) != (b < 0) ? b : 0) : 0; }

static double rest_d(double a, double b) { double r = fmod(a, b); return r && (r < 0) != (b < 0) ? r + b : r; }

static long round_l(double x)
{
    const double whole = floor(x), rest = x - whole;
    return (long)(rest > 0.5 || (rest == 0.5 && fmod(whole, 2) != 0) ? whole + 1 : whole);
}

static double power_d(double x, int n)
{
    double out = n & 1 ? x : 1;
    while (n >>= 1) {
        x *= x;
        out = n & 1 ? out * x : out;
    }
    return out;
}

static void parted_d(double x, double *result) { int n; result[0] = frexp(x, &n); result[1] = n; }
