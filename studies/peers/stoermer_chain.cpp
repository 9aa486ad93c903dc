// Stoermer's method on shear chains: one force evaluation per step, samples in vector registers, on one thread; peak
// storey drifts only. STOREYS, REAL, BOUC_WEN and BILINEAR (0 or 1) are given to the compiler.
//
// Storey i (0 is at the base) has the force k (b d + (1 - b) dy z) + c d', with drift d and hysteretic value z:
//   bilinear: z = clamp(z + change of d / dy, -1, 1); Bouc-Wen: dy z' = d' - (|d'| z + d' |z|) / 2.
// Every storey of every sample has its own stiffness k, dashpot c, mass, yield drift dy and hardening ratio b; every
// sample has its own mass-proportional damping a0.
//
// The unknowns are drifts times b k, so that the hardening part of the force is the unknown. w is the velocity at the
// half step times h, and a the acceleration times h^2 with the forces of the last step:
//   a = up (F[i + 1] - F[i]) - down (F[i] - F[i - 1]);  w = retained w + a;  path = path + w;  d = path + a / 12.
// `retained` applies mass-proportional damping to the mean of two half steps. The dashpots use the velocity
// (15 w - 10 w' + 3 w'') / 8, where w' and w'' are values of one and two steps before; with ADAMS_BASHFORTH = 1 they
// use warpdyn's, (23 w - 16 w' + 5 w'') / 12, which takes the same operations. z follows the change of d. With
// X = change of d / dy, x = |X| / 2 and e = 1 - (sign of X) z, a Bouc-Wen storey has
//   z = z + X min(1, e - (x - 2 x^2 / 3) min(1, e)), of order 3 in the change of the drift, stable for |X| < 2.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <type_traits>
#include <vector>

#ifndef ADAMS_BASHFORTH
#define ADAMS_BASHFORTH 0
#endif

using Real = REAL;
using Integer = std::conditional_t<sizeof(Real) == 4, int32_t, int64_t>;
#ifdef __AVX512F__
constexpr int width = 64 / sizeof(Real);
#else
constexpr int width = 32 / sizeof(Real);
#endif
typedef Real Row __attribute__((vector_size(width * sizeof(Real))));
typedef Integer Bits __attribute__((vector_size(width * sizeof(Real))));

constexpr int storeys = STOREYS;
constexpr bool is_elastic = !BOUC_WEN && !BILINEAR;
// Weight of the last half step's velocity, and those of the two before, divided by it.
constexpr Real of_last = Real(ADAMS_BASHFORTH ? 23.0 / 12 : 15.0 / 8);
constexpr Real of_second = Real(ADAMS_BASHFORTH ? -16.0 / 23 : -2.0 / 3);
constexpr Real of_third = Real(ADAMS_BASHFORTH ? 5.0 / 23 : 1.0 / 5);
constexpr Integer sign_bit = sizeof(Real) == 4 ? Integer(INT32_MIN) : Integer(INT64_MIN);
// Rows per block: in a short chain each operation waits for the one before, so several rows are integrated together.
constexpr int rows = storeys == 1 ? 8 : storeys <= 3 ? 4 : storeys <= 5 ? 2 : 1;
constexpr int block = rows * width;  // samples

static inline Row absolute(Row x) { return (Row)((Bits)x & ~sign_bit); }
static inline Row larger(Row x, Row y) { return x > y ? x : y; }
static inline Row smaller(Row x, Row y) { return x < y ? x : y; }
static inline Row times_sign(Row x, Row signs) { return (Row)((Bits)x ^ ((Bits)signs & sign_bit)); }

// Arrays [storey][sample]; scale of the motion and mass-proportional damping [sample].
struct Ensemble {
  const Real *stiffness, *dashpot, *inverse_mass, *yield_drift, *hardening_ratio, *scale, *mass_damping;
  int samples;
};

static void integrate(const Ensemble& x, const Real* acceleration, int steps, Real h, int first, Row* peaks) {
  Row up[storeys][rows], down[storeys][rows], damping[storeys][rows], excess[storeys][rows], inverse[storeys][rows];
  Row hardening[storeys][rows], retained[rows];
  Row w[storeys][rows] = {}, w_before[storeys][rows] = {}, path[storeys][rows] = {}, state[storeys][rows] = {};
  Row forces[storeys][rows] = {}, z[storeys][rows] = {}, peak[storeys][rows] = {};
  for (int m = 0; m < block; m++) {
    const int sample = std::min(first + m, x.samples - 1), o = m / width, l = m % width;
    const Real half = x.mass_damping[sample] * h / 2, unit = h * h / (1 + half);
    retained[o][l] = (1 - half) / (1 + half);
    for (int i = 0; i < storeys; i++) {
      const size_t e = i * (size_t)x.samples + sample;
      const Real q = is_elastic ? x.stiffness[e] : x.hardening_ratio[e] * x.stiffness[e];
      hardening[i][o][l] = q;
      up[i][o][l] = q * x.inverse_mass[e] * unit;
      down[i][o][l] = q * unit * (i ? x.inverse_mass[e - x.samples] : x.scale[sample]);
      damping[i][o][l] = x.dashpot[e] / (q * h) * of_last;
      excess[i][o][l] = x.yield_drift[e] * (x.stiffness[e] - q);
      inverse[i][o][l] = 1 / (x.yield_drift[e] * q);
    }
    // The values of w before the start are those of a constant acceleration from rest; d is 0 at the start.
    w[0][o][l] = down[0][o][l] * acceleration[0] * (1 + half) / 2;
    w_before[0][o][l] = 3 * w[0][o][l];
    path[0][o][l] = down[0][o][l] * acceleration[0] / 12;
  }
  for (int n = 0; n < steps; n++) {
    Row below[rows];
    for (Row& each : below) each = Row{} + acceleration[n];
#pragma GCC unroll 20
    for (int i = 0; i < storeys; i++) {
#pragma GCC unroll 8
      for (int m = 0; m < rows; m++) {
        const Row above = i < storeys - 1 ? forces[i + 1][m] - forces[i][m] : -forces[i][m];
        const Row a = up[i][m] * above - down[i][m] * below[m], before = w[i][m];
        below[m] = above;
        const Row now = w[i][m] = retained[m] * before + a;
        path[i][m] += now;
        const Row drift = path[i][m] + Real(1.0 / 12) * a;
        Row force = drift + damping[i][m] * (now + (of_third * w_before[i][m] + of_second * before));
        w_before[i][m] = before;
        if (BILINEAR) {
          z[i][m] = smaller(larger(drift * inverse[i][m] - state[i][m], Row{} - 1), Row{} + 1);
          state[i][m] = drift * inverse[i][m] - z[i][m];  // plastic drift / dy
        }
        if (BOUC_WEN) {
          const Row change = (drift - state[i][m]) * inverse[i][m], e = 1 - times_sign(z[i][m], change);
          const Row x2 = Real(0.5) * absolute(change), reach = x2 - Real(2.0 / 3) * x2 * x2;
          z[i][m] += change * smaller(Row{} + 1, e - reach * smaller(Row{} + 1, e));
          state[i][m] = drift;
        }
        if (!is_elastic) force += excess[i][m] * z[i][m];
        forces[i][m] = force;
        peak[i][m] = larger(peak[i][m], absolute(drift));
      }
    }
  }
  for (int i = 0; i < storeys; i++)
    for (int m = 0; m < rows; m++) peaks[i * rows + m] = peak[i][m] / hardening[i][m];
}

// Integrates all samples, writes their peak drifts [storey][sample], and returns how long the integration took [s].
extern "C" double stoermer_chain(const Real* stiffness, const Real* dashpot, const Real* inverse_mass,
                                 const Real* yield_drift, const Real* hardening_ratio, const Real* scale,
                                 const Real* mass_damping, const Real* acceleration, int steps, double step,
                                 int samples, Real* peaks) {
  const Ensemble ensemble = {stiffness, dashpot, inverse_mass, yield_drift, hardening_ratio, scale, mass_damping,
                             samples};
  const int blocks = (samples + block - 1) / block;
  std::vector<Row> found(storeys * rows * (size_t)blocks);
  const auto started = std::chrono::steady_clock::now();
  for (int b = 0; b < blocks; b++)
    integrate(ensemble, acceleration, steps, Real(step), b * block, &found[b * (size_t)(storeys * rows)]);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  for (int i = 0; i < storeys; i++)
    for (int n = 0; n < samples; n++) {
      const int b = n / block, m = n % block;
      peaks[i * (size_t)samples + n] = found[b * (size_t)(storeys * rows) + i * rows + m / width][m % width];
    }
  return seconds;
}
