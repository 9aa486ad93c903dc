// RK4 on shear chains, LANES samples side by side in vector registers, on one thread; peak storey drifts only.
// STOREYS, LANES, REAL, BOUC_WEN and BILINEAR (0 or 1) are given to the compiler. Arrays are [block][storey][lane].
#include <chrono>
#include <initializer_list>
#include <type_traits>

using Real = REAL;
using Integer = std::conditional_t<sizeof(Real) == 4, int, long>;
typedef Real Row __attribute__((vector_size(LANES * sizeof(Real))));
typedef Integer Bits __attribute__((vector_size(LANES * sizeof(Real))));

constexpr int storeys = STOREYS;
constexpr Integer sign_bit = sizeof(Real) == 4 ? Integer(0x80000000u) : Integer(1ul << (8 * sizeof(Integer) - 1));

static inline Row absolute(Row x) { return (Row)((Bits)x & ~sign_bit); }
static inline Row larger(Row x, Row y) { return x > y ? x : y; }
static inline Row smaller(Row x, Row y) { return x < y ? x : y; }

// The hysteretic value is Bouc-Wen's z, or the plastic drift of the bilinear law, which follows the accepted state alone.
struct State {
  Row displacement[storeys], velocity[storeys], hysteretic[storeys];
};

// The plastic drift where the drift is: what is farther from it than the yield drift is dragged along.
static inline Row dragged(Row plastic, Row drift) {
  constexpr Real yield = Real(YIELD_DRIFT);
  return smaller(larger(plastic, drift - yield), drift + yield);
}

// One stage of four. The chain is walked from the top down, so that the force from above is at hand and each storey's
// stage state can be overwritten once the storey above has used it. The first stage's state is the accepted one, and the
// last stage leaves the new one in its place.
template <bool first, bool last>
static inline void stage(State& accepted, State& trial, State& sum, Row ground, const Row* stiffness,
                         const Row* damping, const Row* inverse_mass, Real step, Real reach) {
  constexpr Real hardening = Real(HARDENING_RATIO), yield = Real(YIELD_DRIFT), inverse_yield = Real(1 / YIELD_DRIFT);
  const Real sixth = step / 6;
  const State& now = first ? accepted : trial;
  auto advance = [&](Row& accepted, Row& trial, Row& sum, Row slope) {
    if constexpr (last) {
      accepted += sixth * (sum + slope);
    } else {
      sum = first ? slope : sum + 2 * slope;
      trial = accepted + reach * slope;
    }
  };
  Row above = {};
#pragma GCC unroll 16  // beyond that the code outgrows the caches: at 60 storeys it would run at half the speed
  for (int i = storeys - 1; i >= 0; i--) {
    const Row u = now.displacement[i], v = now.velocity[i];
    const Row drift = i ? u - now.displacement[i - 1] : u, rate = i ? v - now.velocity[i - 1] : v;
    Row force;
    if (BOUC_WEN) {
      const Row z = now.hysteretic[i];
      force = stiffness[i] * (hardening * drift + ((1 - hardening) * yield) * z) + damping[i] * rate;
      const Row growth = (rate - Real(0.5) * (absolute(rate) * z + rate * absolute(z))) * inverse_yield;
      advance(accepted.hysteretic[i], trial.hysteretic[i], sum.hysteretic[i], growth);
    } else if (BILINEAR) {
      const Row elastic = smaller(larger(drift - accepted.hysteretic[i], Row{} - yield), Row{} + yield);
      force = stiffness[i] * (hardening * drift + (1 - hardening) * elastic) + damping[i] * rate;
    } else {
      force = stiffness[i] * drift + damping[i] * rate;
    }
    const Row acceleration = (above - force) * inverse_mass[i] - ground;
    above = force;
    advance(accepted.displacement[i], trial.displacement[i], sum.displacement[i], v);
    advance(accepted.velocity[i], trial.velocity[i], sum.velocity[i], acceleration);
  }
}

static void integrate(const Row* stiffness, const Row* damping, const Row* inverse_mass, const Row* scale,
                      const Real* acceleration, int steps, Real step, Row* peaks) {
  State accepted = {}, trial, sum;
  Row peak[storeys] = {}, before = acceleration[0] * *scale;
  for (int n = 0; n < steps; n++) {
    const Row after = acceleration[n + 1] * *scale, middle = Real(0.5) * (before + after);
    stage<true, false>(accepted, trial, sum, before, stiffness, damping, inverse_mass, step, step / 2);
    for (const Real reach : {step / 2, step})
      stage<false, false>(accepted, trial, sum, middle, stiffness, damping, inverse_mass, step, reach);
    stage<false, true>(accepted, trial, sum, after, stiffness, damping, inverse_mass, step, Real(0));
    for (int i = 0; i < storeys; i++) {
      const Row drift = i ? accepted.displacement[i] - accepted.displacement[i - 1] : accepted.displacement[i];
      peak[i] = larger(peak[i], absolute(drift));
      if (BILINEAR) accepted.hysteretic[i] = dragged(accepted.hysteretic[i], drift);
    }
    before = after;
  }
  for (int i = 0; i < storeys; i++) peaks[i] = peak[i];
}

// Integrates all blocks and returns how long it took [s].
extern "C" double shear_chain(const void* stiffness, const void* damping, const void* inverse_mass, const void* scale,
                              const void* acceleration, int steps, double step, int blocks, void* peaks) {
  const auto started = std::chrono::steady_clock::now();
  for (int b = 0; b < blocks; b++) {
    const int first = b * storeys;
    integrate((const Row*)stiffness + first, (const Row*)damping + first, (const Row*)inverse_mass + first,
              (const Row*)scale + b, (const Real*)acceleration, steps, Real(step), (Row*)peaks + first);
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
}
