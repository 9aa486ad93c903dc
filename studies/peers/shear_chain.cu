// RK4 on shear chains, one sample a thread, its whole history in registers; peak storey drifts, or all that warpdyn
// records by default. STOREYS, REAL, BOUC_WEN, BILINEAR and EVERY_RECORDER (0 or 1 each) are given to the compiler.
// Arrays are [storey][sample].
#include <cuda_runtime.h>

#include <type_traits>

using Real = REAL;
constexpr int storeys = STOREYS, threads_of_a_block = 128;
// Rows of what is written: peak drifts, and with every recorder peak floor accelerations, energies that the storeys'
// springs absorb, the time of the largest drift ratio, peak base shear, energy put in, energy in dampers and the error
// of their balance.
constexpr int rows = EVERY_RECORDER ? 3 * storeys + 5 : storeys;

// The hysteretic value is Bouc-Wen's z, or the plastic drift of the bilinear law, which follows the accepted state alone.
struct State {
  Real displacement[storeys], velocity[storeys], hysteretic[storeys];
};

// Drift ratios need heights, which are the same in all samples: as an argument they take no registers.
struct Heights {
  Real inverse[storeys];
};

// Integrals have two sums, of the stages at a step's ends and of those in its middle, which weigh twice as much.
struct Records {
  Real ratio, time, acceleration[storeys], shear, input, viscous, ends[storeys], middle[storeys], supplied;
};

// One stage of four. The chain is walked from the top down, so that the force from above is at hand and each storey's
// stage state can be overwritten once the storey above has used it. The first stage's state is the accepted one, and the
// last stage leaves the new one in its place.
template <bool first, bool last>
__device__ __forceinline__ void stage(State& accepted, State& trial, State& sum, Real ground, const Real* stiffness,
                                      const Real* damping, const Real* inverse_mass, Real step, Real reach,
                                      const Real* mass, const Heights& heights, Records& records, Real time) {
  const Real hardening = Real(HARDENING_RATIO), yield = Real(YIELD_DRIFT), inverse_yield = Real(1 / YIELD_DRIFT);
  const Real sixth = step / 6;
  const State& now = first ? accepted : trial;
  auto advance = [&](Real& accepted, Real& trial, Real& sum, Real slope) {
    if constexpr (last) {
      accepted += sixth * (sum + slope);
    } else {
      sum = first ? slope : sum + 2 * slope;
      trial = accepted + reach * slope;
    }
  };
  Real above = 0, momentum = 0, power = 0, ratio = 0;
#pragma unroll
  for (int i = storeys - 1; i >= 0; i--) {
    const Real u = now.displacement[i], v = now.velocity[i];
    const Real drift = i ? u - now.displacement[i ? i - 1 : 0] : u, rate = i ? v - now.velocity[i ? i - 1 : 0] : v;
    Real force, dashpot = damping[i] * rate;
    if (BOUC_WEN) {
      const Real z = now.hysteretic[i];
      force = stiffness[i] * (hardening * drift + ((1 - hardening) * yield) * z);
      const Real growth = (rate - Real(0.5) * (fabs(rate) * z + rate * fabs(z))) * inverse_yield;
      advance(accepted.hysteretic[i], trial.hysteretic[i], sum.hysteretic[i], growth);
    } else if (BILINEAR) {
      const Real elastic = fmin(fmax(drift - accepted.hysteretic[i], -yield), yield);
      force = stiffness[i] * (hardening * drift + (1 - hardening) * elastic);
    } else {
      force = stiffness[i] * drift;
    }
    if (EVERY_RECORDER) {
      Real& absorbed = first || last ? records.ends[i] : records.middle[i];
      absorbed += force * rate;
      momentum += mass[i] * v;
      power += dashpot * rate;
      if (first) ratio = fmax(ratio, fabs(drift) * heights.inverse[i]);
      if (first && i == 0) records.shear = fmax(records.shear, fabs(force));
    }
    force += dashpot;
    const Real absolute = (above - force) * inverse_mass[i], acceleration = absolute - ground;
    if (EVERY_RECORDER && first) records.acceleration[i] = fmax(records.acceleration[i], fabs(absolute));
    above = force;
    advance(accepted.displacement[i], trial.displacement[i], sum.displacement[i], v);
    advance(accepted.velocity[i], trial.velocity[i], sum.velocity[i], acceleration);
  }
  if (EVERY_RECORDER) {
    const Real weight = first || last ? sixth : 2 * sixth;
    records.input -= weight * ground * momentum;
    records.viscous += weight * power;
    if (first && ratio > records.ratio) {
      records.ratio = ratio;
      records.time = time;
    }
  }
}

__global__ void integrate(const Real* __restrict__ stiffnesses, const Real* __restrict__ dampings,
                          const Real* __restrict__ inverse_masses, const Real* __restrict__ scales,
                          const Real* __restrict__ acceleration, Heights heights, int steps, Real step, int samples,
                          Real* __restrict__ results) {
  const int sample = blockIdx.x * blockDim.x + threadIdx.x;
  if (sample >= samples) return;
  State accepted = {}, trial, sum;
  Real stiffness[storeys], damping[storeys], inverse_mass[storeys], mass[storeys], peak[storeys] = {};
  Records records = {};
#pragma unroll
  for (int i = 0; i < storeys; i++) {
    stiffness[i] = stiffnesses[i * samples + sample];
    damping[i] = dampings[i * samples + sample];
    inverse_mass[i] = inverse_masses[i * samples + sample];
    mass[i] = 1 / inverse_mass[i];
  }
  const Real scale = scales[sample];
  Real before = acceleration[0] * scale;
  for (int n = 0; n < steps; n++) {
    const Real after = acceleration[n + 1] * scale, middle = Real(0.5) * (before + after);
    auto run = [&](auto first, auto last, Real ground, Real reach) {
      stage<first.value, last.value>(accepted, trial, sum, ground, stiffness, damping, inverse_mass, step, reach, mass,
                                     heights, records, n * step);
    };
    const std::false_type no;
    const std::true_type yes;
    run(yes, no, before, step / 2);
    run(no, no, middle, step / 2);
    run(no, no, middle, step);
    run(no, yes, after, Real(0));
    records.supplied = fmax(records.supplied, fabs(records.input));
#pragma unroll
    for (int i = 0; i < storeys; i++) {
      const Real below = i ? accepted.displacement[i ? i - 1 : 0] : Real(0);
      const Real drift = accepted.displacement[i] - below;
      peak[i] = fmax(peak[i], fabs(drift));
      if (BILINEAR) {
        const Real yield = Real(YIELD_DRIFT);
        accepted.hysteretic[i] = fmin(fmax(accepted.hysteretic[i], drift - yield), drift + yield);
      }
    }
    before = after;
  }
#pragma unroll
  for (int i = 0; i < storeys; i++) results[i * samples + sample] = peak[i];
  if (EVERY_RECORDER) {
    Real unaccounted = records.input - records.viscous;
#pragma unroll
    for (int i = 0; i < storeys; i++) {
      const Real absorbed = step / 6 * (records.ends[i] + 2 * records.middle[i]);
      unaccounted -= absorbed + mass[i] * accepted.velocity[i] * accepted.velocity[i] / 2;
      results[(storeys + i) * samples + sample] = records.acceleration[i];
      results[(2 * storeys + i) * samples + sample] = absorbed;
    }
    const Real single[5] = {records.time, records.shear, records.input, records.viscous,
                            unaccounted / records.supplied};
#pragma unroll
    for (int k = 0; k < 5; k++) results[(3 * storeys + k) * samples + sample] = single[k];
  }
}

// Copies the arrays to the device, integrates all samples again and again for `timed_for` seconds, and copies the
// results back. Writes the least time of a run [s], the kernel's registers and its local memory [bytes]; returns an error of
// CUDA, or 0.
extern "C" int shear_chain(const Real* stiffness, const Real* damping, const Real* inverse_mass, const Real* scale,
                           const Real* acceleration, int steps, double step, int samples, double height,
                           double timed_for, Real* results, double* seconds, int* registers, int* local_bytes) {
  const size_t table = sizeof(Real) * storeys * samples;
  const size_t sizes[6] = {table, table, table, sizeof(Real) * samples, sizeof(Real) * (steps + 1),
                           sizeof(Real) * rows * samples};
  const Real* given[5] = {stiffness, damping, inverse_mass, scale, acceleration};
  Real* device[6] = {};
  for (int k = 0; k < 6; k++) {
    if (const cudaError_t error = cudaMalloc(&device[k], sizes[k])) return error;
    if (k < 5) cudaMemcpy(device[k], given[k], sizes[k], cudaMemcpyHostToDevice);
  }
  Heights heights;
  for (Real& inverse : heights.inverse) inverse = Real(1 / height);
  cudaEvent_t start, end;
  cudaEventCreate(&start);
  cudaEventCreate(&end);
  *seconds = 1e30;
  double total = 0;
  for (int run = 0; run < 3 || total < timed_for; run++) {
    cudaEventRecord(start);
    integrate<<<(samples + threads_of_a_block - 1) / threads_of_a_block, threads_of_a_block>>>(
        device[0], device[1], device[2], device[3], device[4], heights, steps, Real(step), samples, device[5]);
    cudaEventRecord(end);
    if (const cudaError_t error = cudaEventSynchronize(end)) return error;
    float milliseconds;
    cudaEventElapsedTime(&milliseconds, start, end);
    total += milliseconds / 1e3;
    if (milliseconds / 1e3 < *seconds) *seconds = milliseconds / 1e3;
  }
  cudaFuncAttributes attributes;
  cudaFuncGetAttributes(&attributes, integrate);
  *registers = attributes.numRegs;
  *local_bytes = (int)attributes.localSizeBytes;
  cudaMemcpy(results, device[5], sizes[5], cudaMemcpyDeviceToHost);
  for (Real* pointer : device) cudaFree(pointer);
  return cudaGetLastError();
}

extern "C" const char* error_text(int error) { return cudaGetErrorString((cudaError_t)error); }
