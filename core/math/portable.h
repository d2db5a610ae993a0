#pragma once

namespace tessera {

// Elementary functions of which every machine computes the same bits (law L1: no pixel depends on the machine). A C
// library may choose other code for other processors, and its last bits follow. These use only what IEEE 754 rounds in
// one way (+ - * / and floor, frexp, ldexp, which are exact), in a fixed order: reduce the argument, then sum a series.
// Sources: Cody & Waite 1980, Software Manual for the Elementary Functions, ch. 5 to 11; Muller 2016, Elementary
// Functions, ch. 11. All are pure and safe to call from any thread; NaN in, NaN out. The bounds on errors are what the
// tests hold against long double.

/// Sine, cosine and tangent of an angle in radians from -4π to 4π, within 2 ulp. NaN outside.
double portable_sin(double radians);
double portable_cos(double radians);
double portable_tan(double radians);

/// The angle in [-π/2, π/2], in radians, whose tangent is `x`; any x, infinities too. Within 2 ulp.
double portable_atan(double x);

/// Base-2 logarithm of x > 0, within 4 ulp, near 1 as elsewhere; exact for powers of 2. 0 gives -∞, +∞ gives +∞,
/// less than 0 gives NaN.
double portable_log2(double x);

/// 2 to the power x, within 2 ulp where the result is normal; exact for whole x. Overflows to +∞, underflows to 0.
double portable_exp2(double x);

/// `base` to the power `exponent`, both finite and ≥ 0: computed in double, rounded to float once, within 1 ulp.
/// Anything to the 0 is 1 (0 too), 0 to anything else is 0, 1 to anything is 1. Overflows to +∞.
float portable_pow(float base, float exponent);

}  // namespace tessera
