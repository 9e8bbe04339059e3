// Periodic orbits and spectral radii over force and frequency: LANES columns of frequency side by side, each
// marched up the forces. Variational RK4 and Newton's method; the start is extrapolated from the orbits
// before, by a polynomial in the force. Compiled and called by _map_peers.py.
#include <math.h>

#ifndef LANES
#define LANES 16
#endif
#define PASSES 12

// One stage: rates of the state and of both columns of the variational matrix.
#define RATES(X, V, A, B, C, D, DRIVE, RV, RC, RD)                                       \
    {                                                                                    \
        const double ax = fabs(X), av = fabs(V);                                         \
        RV = (DRIVE) - (X) * (k1 + ax * (k2 + ax * k3)) - (V) * (c1 + av * (c2 + av * c3)); \
        const double kx = k1 + ax * (2.0 * k2 + 3.0 * k3 * ax);                          \
        const double cv = c1 + av * (2.0 * c2 + 3.0 * c3 * av);                          \
        RC = -kx * (A) - cv * (C);                                                       \
        RD = -kx * (B) - cv * (D);                                                       \
    }

// law: k1 k2 k3 c1 c2 c3 over the mass; force: over the mass too; sine: at the stages, 2 count + 1 of them.
// radius, trace, determinant: of the full period, (force, column), NaN where nothing converged. Returns the
// passes of all lanes.
long sweep(int forces, int columns, const double *force, const double *frequency, const double *law,
           int steps, int half, const double *sine, double tolerance, int degree, int threads, double *radius,
           double *trace, double *determinant)
{
    const int count = half ? steps / 2 : steps;
    const int blocks = (columns + LANES - 1) / LANES;
    const double k1 = law[0], k2 = law[1], k3 = law[2], c1 = law[3], c2 = law[4], c3 = law[5];
    const double sign = half ? -1.0 : 1.0;
    long total = 0;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) reduction(+ : total)
    for (int block = 0; block < blocks; block++) {
        double step[LANES], omega[LANES], x[LANES], v[LANES], a[LANES], b[LANES], c[LANES], d[LANES];
        double px[LANES], pv[LANES], size[LANES], sum[LANES], product[LANES];
        double old_x[4][LANES] = {{0}}, old_v[4][LANES] = {{0}}, old_force[4];
        int known = 0;
        for (int l = 0; l < LANES; l++) {
            const int column = block * LANES + l < columns ? block * LANES + l : columns - 1;
            omega[l] = 2.0 * M_PI * frequency[column];
            step[l] = 1.0 / (steps * frequency[column]);
        }
        for (int i = 0; i < forces; i++) {
            const double push = force[i];
            if (!known) {  // the linear answer
                for (int l = 0; l < LANES; l++) {
                    const double re = k1 - omega[l] * omega[l], im = c1 * omega[l];
                    const double scale = push / (re * re + im * im);
                    px[l] = -im * scale;
                    pv[l] = re * omega[l] * scale;
                }
            } else {  // Lagrange's polynomial through the orbits before
                const int points = known < degree + 1 ? known : degree + 1;
                double weight[4];
                for (int p = 0; p < points; p++) {
                    weight[p] = points == 1 ? push / old_force[0] : 1.0;
                    for (int q = 0; q < points; q++)
                        if (q != p) weight[p] *= (push - old_force[q]) / (old_force[p] - old_force[q]);
                }
                for (int l = 0; l < LANES; l++) px[l] = pv[l] = 0.0;
                for (int p = 0; p < points; p++)
                    for (int l = 0; l < LANES; l++) {
                        px[l] += weight[p] * old_x[p][l];
                        pv[l] += weight[p] * old_v[p][l];
                    }
            }
            int pass = 0;
            for (; pass < PASSES; pass++) {
                for (int l = 0; l < LANES; l++) {
                    x[l] = px[l], v[l] = pv[l];
                    a[l] = d[l] = 1.0, b[l] = c[l] = 0.0;
                }
                for (int n = 0; n < count; n++) {
                    const double f0 = push * sine[2 * n], f1 = push * sine[2 * n + 1], f2 = push * sine[2 * n + 2];
#pragma omp simd
                    for (int l = 0; l < LANES; l++) {
                        const double h = step[l], g = 0.5 * step[l], w = step[l] / 6.0;
                        const double xs = x[l], vs = v[l], as = a[l], bs = b[l], cs = c[l], ds = d[l];
                        double p1, q1, r1, p2, q2, r2, p3, q3, r3, p4, q4, r4;
                        RATES(xs, vs, as, bs, cs, ds, f0, p1, q1, r1);
                        const double v2 = vs + g * p1, cc2 = cs + g * q1, dd2 = ds + g * r1;
                        RATES(xs + g * vs, v2, as + g * cs, bs + g * ds, cc2, dd2, f1, p2, q2, r2);
                        const double v3 = vs + g * p2, cc3 = cs + g * q2, dd3 = ds + g * r2;
                        RATES(xs + g * v2, v3, as + g * cc2, bs + g * dd2, cc3, dd3, f1, p3, q3, r3);
                        const double v4 = vs + h * p3, cc4 = cs + h * q3, dd4 = ds + h * r3;
                        RATES(xs + h * v3, v4, as + h * cc3, bs + h * dd3, cc4, dd4, f2, p4, q4, r4);
                        x[l] = xs + w * (vs + 2.0 * (v2 + v3) + v4);
                        v[l] = vs + w * (p1 + 2.0 * (p2 + p3) + p4);
                        a[l] = as + w * (cs + 2.0 * (cc2 + cc3) + cc4);
                        b[l] = bs + w * (ds + 2.0 * (dd2 + dd3) + dd4);
                        c[l] = cs + w * (q1 + 2.0 * (q2 + q3) + q4);
                        d[l] = ds + w * (r1 + 2.0 * (r2 + r3) + r4);
                    }
                }
                int late = 0;
                for (int l = 0; l < LANES; l++) {
                    const double ma = sign * a[l], mb = sign * b[l], mc = sign * c[l], md = sign * d[l];
                    const double gx = sign * x[l] - px[l], gv = sign * v[l] - pv[l];
                    const double divisor = (1.0 - ma) * (1.0 - md) - mb * mc;
                    const double dx = ((1.0 - md) * gx + mb * gv) / divisor;
                    const double dv = (mc * gx + (1.0 - ma) * gv) / divisor;
                    sum[l] = ma + md, product[l] = ma * md - mb * mc;
                    px[l] += dx, pv[l] += dv;
                    const double motion = sqrt(px[l] * px[l] + pv[l] * pv[l] / (omega[l] * omega[l]));
                    size[l] = fmax(fabs(dx), fabs(dv) / omega[l]) / motion;
                    late |= !(size[l] <= tolerance);
                }
                total += LANES;
                if (!late) break;
            }
            for (int l = 0; l < LANES && block * LANES + l < columns; l++) {
                const long cell = (long)i * columns + block * LANES + l;
                const int good = size[l] <= tolerance;
                const double full = half ? sum[l] * sum[l] - 2.0 * product[l] : sum[l];
                const double both = half ? product[l] * product[l] : product[l];
                const double root = full * full - 4.0 * both;
                trace[cell] = good ? full : NAN;
                determinant[cell] = good ? both : NAN;
                radius[cell] = !good ? NAN : root > 0.0 ? 0.5 * (fabs(full) + sqrt(root)) : sqrt(fabs(both));
            }
            for (int p = 3; p > 0; p--) {
                old_force[p] = old_force[p - 1];
                for (int l = 0; l < LANES; l++) old_x[p][l] = old_x[p - 1][l], old_v[p][l] = old_v[p - 1][l];
            }
            old_force[0] = push;
            for (int l = 0; l < LANES; l++) old_x[0][l] = px[l], old_v[0][l] = pv[l];
            if (known < 4) known++;
        }
    }
    return total;
}
