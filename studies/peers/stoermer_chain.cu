// Stoermer's method on shear chains: one force evaluation per step, one sample per thread, all state in registers; peak
// storey drifts only, in float32. STOREYS, BOUC_WEN and BILINEAR (0 or 1) are given to the compiler. Arrays are
// [storey][sample]. Model and method: see stoermer_chain.cpp.
//
// A bilinear storey has z from 0 to 1 instead of -1 to 1, so that one instruction (multiply-add with saturation) adds
// the change of the drift and limits the result. Its force then has the constant offset excess / 2; `rest` removes it
// in an operation that is needed in any case.
#include <cuda_runtime.h>

#define UNROLL _Pragma("unroll")
constexpr int storeys = STOREYS, threads_of_a_block = 128;
constexpr bool is_elastic = !BOUC_WEN && !BILINEAR;

// Arrays [storey][sample]; scale of the motion and mass-proportional damping [sample]; base acceleration at every step,
// aligned to 16 bytes.
struct Data {
  const float *stiffness, *dashpot, *inverse_mass, *yield_drift, *hardening_ratio, *scale, *mass_damping, *acceleration;
  float* peaks;
  int samples, steps;
  float h;
};

__global__ void __launch_bounds__(threads_of_a_block) integrate(Data x) {
  const int sample = blockIdx.x * threads_of_a_block + threadIdx.x;
  if (sample >= x.samples) return;
  float up[storeys], down[storeys], damping[storeys], excess[storeys], inverse[storeys], rest[storeys];
  float w[storeys] = {}, w_before[storeys] = {}, path[storeys] = {}, state[storeys] = {}, forces[storeys] = {};
  float z[storeys] = {}, peak[storeys] = {};
  const float half = x.mass_damping[sample] * x.h / 2, retained = (1 - half) / (1 + half);
  const float unit = x.h * x.h / (1 + half);
  UNROLL for (int i = 0; i < storeys; i++) {
    const int m = i * x.samples + sample;
    const float k = x.stiffness[m], q = is_elastic ? k : x.hardening_ratio[m] * k;
    const float yield_drift = is_elastic ? 1.f : x.yield_drift[m];
    up[i] = q * x.inverse_mass[m] * unit;
    down[i] = q * unit * (i ? x.inverse_mass[m - x.samples] : x.scale[sample]);
    damping[i] = x.dashpot[m] / (q * x.h) * 1.875f;
    excess[i] = (BILINEAR ? 2.f : 1.f) * yield_drift * (k - q);
    inverse[i] = (BILINEAR ? 0.5f : 1.f) / (yield_drift * q);
    if (BILINEAR) {
      z[i] = 0.5f;
      state[i] = -0.5f;
      forces[i] = 0.5f * excess[i];
    }
  }
  UNROLL for (int i = 0; i < storeys; i++) {
    const float above = forces[i] - (i < storeys - 1 ? forces[i + 1] : 0.f);
    rest[i] = up[i] * above + (i ? down[i] * (forces[i] - forces[i - 1]) : 0.f);
  }
  // The values of w before the start are those of a constant acceleration from rest; the drift is 0 at the start.
  w[0] = down[0] * x.acceleration[0] * (1 + half) / 2;
  w_before[0] = 3 * w[0];
  path[0] = down[0] * x.acceleration[0] / 12;
  // below: mass times absolute acceleration of the floor below, or the base acceleration
  auto step = [&](float below) {
    UNROLL for (int i = 0; i < storeys; i++) {
      const float above = i < storeys - 1 ? forces[i + 1] - forces[i] : -forces[i], before = w[i];
      const float a =
          BILINEAR ? fmaf(up[i], above, fmaf(-down[i], below, rest[i])) : fmaf(up[i], above, -down[i] * below);
      below = above;
      w[i] = fmaf(retained, before, a);
      path[i] += w[i];
      const float drift = fmaf(1.f / 12, a, path[i]);
      float force = fmaf(damping[i], fmaf(-2.f / 3, before, fmaf(0.2f, w_before[i], w[i])), drift);
      w_before[i] = before;
      if (BILINEAR) {
        z[i] = __saturatef(fmaf(drift, inverse[i], -state[i]));
        state[i] = fmaf(drift, inverse[i], -z[i]);  // plastic drift, scaled as z
      }
      if (BOUC_WEN) {
        const float change = (drift - state[i]) * inverse[i], e = fmaf(-copysignf(1.f, change), z[i], 1.f);
        const float x2 = 0.5f * fabsf(change), reach = x2 * fmaf(2.f / 3, x2, -1.f);
        z[i] = fmaf(change, fminf(fmaf(reach, fminf(e, 1.f), e), 1.f), z[i]);
        state[i] = drift;
      }
      if (!is_elastic) force = fmaf(excess[i], z[i], force);
      forces[i] = force;
      peak[i] = fmaxf(peak[i], fabsf(drift));
    }
  };
  constexpr int turn = storeys <= 5 ? 8 : 4;  // steps per turn of the loop
  int n = 0;
  for (; n + turn <= x.steps; n += turn) {
    float4 base[turn / 4];
    UNROLL for (int j = 0; j < turn / 4; j++) base[j] = __ldg((const float4*)(x.acceleration + n) + j);
    UNROLL for (int j = 0; j < turn / 4; j++) {
      step(base[j].x);
      step(base[j].y);
      step(base[j].z);
      step(base[j].w);
    }
  }
#pragma unroll 1
  for (; n < x.steps; n++) step(__ldg(x.acceleration + n));
  float sum = 0;
  UNROLL for (int i = 0; i < storeys; i++) sum += path[i];
  UNROLL for (int i = 0; i < storeys; i++) {
    const int m = i * x.samples + sample;
    const float q = is_elastic ? x.stiffness[m] : x.hardening_ratio[m] * x.stiffness[m];
    x.peaks[m] = isfinite(sum) ? peak[i] / q : nanf("");
  }
}

// Copies the arrays to the device, integrates all samples repeatedly for `timed_for` seconds, and copies the peaks back.
// Writes the least time of a run [s], the kernel's registers and its local memory [bytes]; returns an error of
// CUDA, or 0.
extern "C" int stoermer_chain(const float* stiffness, const float* dashpot, const float* inverse_mass,
                              const float* yield_drift, const float* hardening_ratio, const float* scale,
                              const float* mass_damping, const float* acceleration, int steps, double step, int samples,
                              double timed_for, float* peaks, double* seconds, int* registers, int* local_bytes) {
  const size_t table = sizeof(float) * storeys * samples, row = sizeof(float) * samples;
  const size_t sizes[9] = {table, table, table, table, table, row, row, sizeof(float) * (steps + 1), table};
  const float* given[8] = {stiffness, dashpot, inverse_mass, yield_drift, hardening_ratio, scale, mass_damping,
                           acceleration};
  float* device[9] = {};
  for (int k = 0; k < 9; k++) {
    if (const cudaError_t error = cudaMalloc(&device[k], sizes[k])) return error;
    if (k < 8) cudaMemcpy(device[k], given[k], sizes[k], cudaMemcpyHostToDevice);
  }
  const Data x = {device[0], device[1], device[2], device[3], device[4], device[5], device[6],  device[7],
                  device[8], samples,   steps,     float(step)};
  cudaEvent_t start, end;
  cudaEventCreate(&start);
  cudaEventCreate(&end);
  *seconds = 1e30;
  double total = 0;
  for (int run = 0; run < 3 || total < timed_for; run++) {
    cudaEventRecord(start);
    integrate<<<(samples + threads_of_a_block - 1) / threads_of_a_block, threads_of_a_block>>>(x);
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
  cudaMemcpy(peaks, device[8], table, cudaMemcpyDeviceToHost);
  for (float* pointer : device) cudaFree(pointer);
  return cudaGetLastError();
}

extern "C" const char* error_text(int error) { return cudaGetErrorString((cudaError_t)error); }
