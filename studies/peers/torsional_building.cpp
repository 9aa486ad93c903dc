// Hand-written C++: torsional buildings of ten storeys with four bilinear walls in each, with LANES samples per vector
// register, on one thread; peak deformations of the walls only.
//
// A floor has a mass, a radius of gyration about the centre of mass, two displacements and a rotation. Walls 0 and 1 of a
// storey act along x, walls 2 and 3 along y; a wall's deformation is the drift along it plus its arm times the rotation
// between the floors. A wall is bilinear with kinematic hardening and has a dashpot in proportion to its stiffness. The
// unknowns are storey drifts, on each of which mass-proportional damping then acts alone.
#include <chrono>
#include <vector>

constexpr int storeys = 10, own_walls = 4;
typedef REAL Real;
typedef Real Row __attribute__((vector_size(LANES * sizeof(Real))));
#define EACH for (int c = 0; c < 3; c++) for (int i = 0; i < storeys; i++)

static Row larger(Row a, Row b) { return a > b ? a : b; }
static Row smaller(Row a, Row b) { return a < b ? a : b; }

struct Building {
  Row stiffness[storeys][own_walls], yields[storeys][own_walls], inverse_mass[storeys], arm[own_walls], scale;
};
struct Constants {
  Real mass_damping, stiffness_damping, hardening_ratio, inverse_gyration;
};

// Accelerations of the drifts; of an accepted state, plastic deformations and peaks follow.
template <bool is_accepted>
static inline void accelerate(const Building& b, const Constants& k, const Row drift[3][storeys],
                              const Row rate[3][storeys], Row ground_x, Row ground_y, Row plastic[storeys][own_walls],
                              Row peak[storeys][own_walls], Row acceleration[3][storeys]) {
  Row force[3][storeys + 1];
  for (int i = 0; i < storeys; i++) {
    Row wall[own_walls];
    for (int w = 0; w < own_walls; w++) {
      const Row deformation = drift[w / 2][i] + b.arm[w] * drift[2][i], speed = rate[w / 2][i] + b.arm[w] * rate[2][i];
      const Row elastic = smaller(larger(deformation - plastic[i][w], -b.yields[i][w]), b.yields[i][w]);
      wall[w] = b.stiffness[i][w] *
                (k.hardening_ratio * deformation + (1 - k.hardening_ratio) * elastic + k.stiffness_damping * speed);
      if (is_accepted) {
        plastic[i][w] = deformation - elastic;
        peak[i][w] = larger(peak[i][w], larger(deformation, -deformation));
      }
    }
    force[0][i] = wall[0] + wall[1];
    force[1][i] = wall[2] + wall[3];
    force[2][i] = b.arm[0] * wall[0] + b.arm[1] * wall[1] + b.arm[2] * wall[2] + b.arm[3] * wall[3];
  }
  for (int c = 0; c < 3; c++) {
    force[c][storeys] = Row{};
    Row below = c == 0 ? ground_x : c == 1 ? ground_y : Row{};
    for (int i = 0; i < storeys; i++) {
      Row floor = (force[c][i + 1] - force[c][i]) * b.inverse_mass[i];
      if (c == 2) floor *= k.inverse_gyration;
      acceleration[c][i] = floor - below - k.mass_damping * rate[c][i];
      below = floor;
    }
  }
}

template <bool is_rk4>
static void integrate(const Building& b, const Constants& k, const Real* motion, int steps, Real h,
                      Row peak[storeys][own_walls]) {
  Row d[3][storeys] = {}, v[3][storeys] = {}, a[3][storeys] = {}, plastic[storeys][own_walls] = {};
  Row s[3][storeys], q[3][storeys], sum_d[3][storeys], sum_v[3][storeys];  // of a stage, and sums of slopes
  for (int n = 0; n < steps; n++) {
    const Row x0 = motion[2 * n] * b.scale, y0 = motion[2 * n + 1] * b.scale;
    const Row x1 = motion[2 * n + 2] * b.scale, y1 = motion[2 * n + 3] * b.scale;
    if (!is_rk4) {  // dashpots act at the velocity that the last acceleration predicts
      EACH {
        s[c][i] = v[c][i] + Real(0.5) * h * a[c][i];
        d[c][i] += h * s[c][i];
        q[c][i] = s[c][i] + Real(0.5) * h * a[c][i];
      }
      accelerate<true>(b, k, d, q, x1, y1, plastic, peak, a);
      EACH v[c][i] = s[c][i] + Real(0.5) * h * a[c][i];
      continue;
    }
    accelerate<true>(b, k, d, v, x0, y0, plastic, peak, a);
    EACH {
      sum_d[c][i] = v[c][i];
      sum_v[c][i] = a[c][i];
      s[c][i] = d[c][i] + Real(0.5) * h * v[c][i];
      q[c][i] = v[c][i] + Real(0.5) * h * a[c][i];
    }
    for (int stage = 1; stage < 3; stage++) {
      accelerate<false>(b, k, s, q, Real(0.5) * (x0 + x1), Real(0.5) * (y0 + y1), plastic, peak, a);
      const Real reach = stage == 2 ? h : Real(0.5) * h;
      EACH {
        sum_d[c][i] += 2 * q[c][i];
        sum_v[c][i] += 2 * a[c][i];
        s[c][i] = d[c][i] + reach * q[c][i];
        q[c][i] = v[c][i] + reach * a[c][i];
      }
    }
    accelerate<false>(b, k, s, q, x1, y1, plastic, peak, a);
    EACH {
      d[c][i] += h / 6 * (sum_d[c][i] + q[c][i]);
      v[c][i] += h / 6 * (sum_v[c][i] + a[c][i]);
    }
  }
  if (is_rk4) accelerate<true>(b, k, d, v, Row{}, Row{}, plastic, peak, a);
}

// Integrates all samples (a multiple of LANES), writes the peaks [wall][sample], and returns how long this took [s].
extern "C" double torsional_building(const Real* stiffness, const Real* yield_deformation, const Real* inverse_mass,
                                     const Real* arm, const Real* scale, const Real* motion, const double* constants,
                                     int steps, double step, int samples, int is_rk4, Real* peaks) {
  const Constants k = {Real(constants[0]), Real(constants[1]), Real(constants[2]), Real(constants[3])};
  const int blocks = samples / LANES;
  std::vector<Building> buildings(blocks);
  std::vector<Row> found(blocks * storeys * own_walls);
  for (int n = 0; n < samples; n++) {
    Building& b = buildings[n / LANES];
    const int lane = n % LANES;
    for (int i = 0; i < storeys; i++) {
      b.inverse_mass[i][lane] = inverse_mass[i * samples + n];
      for (int w = 0; w < own_walls; w++) {
        b.stiffness[i][w][lane] = stiffness[(own_walls * i + w) * samples + n];
        b.yields[i][w][lane] = yield_deformation[(own_walls * i + w) * samples + n];
      }
    }
    for (int w = 0; w < own_walls; w++) b.arm[w][lane] = arm[w * samples + n];
    b.scale[lane] = scale[n];
  }
  const auto started = std::chrono::steady_clock::now();
  for (int n = 0; n < blocks; n++) {
    Row(*peak)[own_walls] = (Row(*)[own_walls])&found[n * storeys * own_walls];
    (is_rk4 ? integrate<true> : integrate<false>)(buildings[n], k, motion, steps, Real(step), peak);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  for (int wall = 0; wall < storeys * own_walls; wall++)
    for (int n = 0; n < samples; n++)
      peaks[wall * samples + n] = found[n / LANES * storeys * own_walls + wall][n % LANES];
  return seconds;
}
