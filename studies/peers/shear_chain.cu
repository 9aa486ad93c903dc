// RK4 on shear chains, one sample a thread, its whole history in registers; peak storey drifts only.
// STOREYS, REAL, BOUC_WEN and BILINEAR (0 or 1 each) are given to the compiler. Arrays are [storey][sample].
#include <cuda_runtime.h>

using Real = REAL;
constexpr int storeys = STOREYS, threads_of_a_block = 128;

// The hysteretic value is Bouc-Wen's z, or the plastic drift of the bilinear law, which follows the accepted state alone.
struct State {
  Real displacement[storeys], velocity[storeys], hysteretic[storeys];
};

// One stage of four. The chain is walked from the top down, so that the force from above is at hand and each storey's
// stage state can be overwritten once the storey above has used it. The first stage's state is the accepted one, and the
// last stage leaves the new one in its place.
template <bool first, bool last>
__device__ __forceinline__ void stage(State& accepted, State& trial, State& sum, Real ground, const Real* stiffness,
                                      const Real* damping, const Real* inverse_mass, Real step, Real reach) {
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
  Real above = 0;
#pragma unroll
  for (int i = storeys - 1; i >= 0; i--) {
    const Real u = now.displacement[i], v = now.velocity[i];
    const Real drift = i ? u - now.displacement[i ? i - 1 : 0] : u, rate = i ? v - now.velocity[i ? i - 1 : 0] : v;
    Real force;
    if (BOUC_WEN) {
      const Real z = now.hysteretic[i];
      force = stiffness[i] * (hardening * drift + ((1 - hardening) * yield) * z) + damping[i] * rate;
      const Real growth = (rate - Real(0.5) * (fabs(rate) * z + rate * fabs(z))) * inverse_yield;
      advance(accepted.hysteretic[i], trial.hysteretic[i], sum.hysteretic[i], growth);
    } else if (BILINEAR) {
      const Real elastic = fmin(fmax(drift - accepted.hysteretic[i], -yield), yield);
      force = stiffness[i] * (hardening * drift + (1 - hardening) * elastic) + damping[i] * rate;
    } else {
      force = stiffness[i] * drift + damping[i] * rate;
    }
    const Real acceleration = (above - force) * inverse_mass[i] - ground;
    above = force;
    advance(accepted.displacement[i], trial.displacement[i], sum.displacement[i], v);
    advance(accepted.velocity[i], trial.velocity[i], sum.velocity[i], acceleration);
  }
}

__global__ void integrate(const Real* __restrict__ stiffnesses, const Real* __restrict__ dampings,
                          const Real* __restrict__ inverse_masses, const Real* __restrict__ scales,
                          const Real* __restrict__ acceleration, int steps, Real step, int samples,
                          Real* __restrict__ peaks) {
  const int sample = blockIdx.x * blockDim.x + threadIdx.x;
  if (sample >= samples) return;
  State accepted = {}, trial, sum;
  Real stiffness[storeys], damping[storeys], inverse_mass[storeys], peak[storeys] = {};
#pragma unroll
  for (int i = 0; i < storeys; i++) {
    stiffness[i] = stiffnesses[i * samples + sample];
    damping[i] = dampings[i * samples + sample];
    inverse_mass[i] = inverse_masses[i * samples + sample];
  }
  const Real scale = scales[sample];
  Real before = acceleration[0] * scale;
  for (int n = 0; n < steps; n++) {
    const Real after = acceleration[n + 1] * scale, middle = Real(0.5) * (before + after);
    stage<true, false>(accepted, trial, sum, before, stiffness, damping, inverse_mass, step, step / 2);
    stage<false, false>(accepted, trial, sum, middle, stiffness, damping, inverse_mass, step, step / 2);
    stage<false, false>(accepted, trial, sum, middle, stiffness, damping, inverse_mass, step, step);
    stage<false, true>(accepted, trial, sum, after, stiffness, damping, inverse_mass, step, Real(0));
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
  for (int i = 0; i < storeys; i++) peaks[i * samples + sample] = peak[i];
}

// Copies the arrays to the device, integrates all samples again and again for `timed_for` seconds, and copies the peaks
// back. Writes the least time of a run [s], the kernel's registers and its local memory [bytes]; returns an error of
// CUDA, or 0.
extern "C" int shear_chain(const Real* stiffness, const Real* damping, const Real* inverse_mass, const Real* scale,
                           const Real* acceleration, int steps, double step, int samples, double timed_for, Real* peaks,
                           double* seconds, int* registers, int* local_bytes) {
  const size_t table = sizeof(Real) * storeys * samples;
  const size_t sizes[6] = {table, table, table, sizeof(Real) * samples, sizeof(Real) * (steps + 1), table};
  const Real* given[5] = {stiffness, damping, inverse_mass, scale, acceleration};
  Real* device[6] = {};
  for (int k = 0; k < 6; k++) {
    if (const cudaError_t error = cudaMalloc(&device[k], sizes[k])) return error;
    if (k < 5) cudaMemcpy(device[k], given[k], sizes[k], cudaMemcpyHostToDevice);
  }
  cudaEvent_t start, end;
  cudaEventCreate(&start);
  cudaEventCreate(&end);
  *seconds = 1e30;
  double total = 0;
  for (int run = 0; run < 3 || total < timed_for; run++) {
    cudaEventRecord(start);
    integrate<<<(samples + threads_of_a_block - 1) / threads_of_a_block, threads_of_a_block>>>(
        device[0], device[1], device[2], device[3], device[4], steps, Real(step), samples, device[5]);
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
  cudaMemcpy(peaks, device[5], table, cudaMemcpyDeviceToHost);
  for (Real* pointer : device) cudaFree(pointer);
  return cudaGetLastError();
}

extern "C" const char* error_text(int error) { return cudaGetErrorString((cudaError_t)error); }
