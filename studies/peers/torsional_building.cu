// Hand-written CUDA: torsional buildings of ten storeys with four bilinear walls in each; peak deformations of the walls.
// The model is that of torsional_building.cpp. Two ways to divide the work:
// - "threads": a thread has a building; stiffness and yield deformation of the walls are in shared memory, all else in
//   registers. This is the fastest way for velocity Verlet; RK4 would need 60 values more.
// - "storeys": a thread has a storey. Three buildings share the 32 threads of a warp; threads 10 and 21 are at rest and
//   stand for the ground and for the free end above the roof. Threads exchange values by shuffles.
#include <cmath>
#include <cuda_runtime.h>

#define UNROLL _Pragma("unroll")
constexpr int storeys = 10, walls = 4 * storeys, own_walls = 4;

struct Data {  // [row][sample]; walls 0 and 1 of a storey act along x, walls 2 and 3 along y
  const float *stiffness, *yield_deformation, *inverse_mass, *arm, *scale;
  const float2* motion;
  float* peaks;
  int samples, steps;
  float step, mass_damping, stiffness_damping, hardening_ratio, inverse_gyration;
};

// Deformation that a wall recovers; the plastic deformation follows.
__device__ __forceinline__ float elastic_part(float deformation, float& plastic, float yields, bool is_accepted) {
  const float elastic = fminf(fmaxf(deformation - plastic, -yields), yields);
  if (is_accepted) plastic = deformation - elastic;
  return elastic;
}

// ---- a thread has a storey ----------------------------------------------------------------------------------------

struct Storey {
  float hardening[own_walls], yielding[own_walls], dashpot[own_walls], yields[own_walls], arm[own_walls];
  float inverse_mass, inverse_inertia;
  int above, below;  // threads of the neighbouring storeys
};

// Accelerations of the storey's drifts, without mass-proportional damping.
template <bool is_accepted>
__device__ __forceinline__ void accelerate(const Storey& s, const float drift[3], const float rate[3], float ground_x,
                                           float ground_y, float plastic[4], float peak[4], float acceleration[3]) {
  float force[own_walls];
  UNROLL for (int w = 0; w < own_walls; w++) {
    const float deformation = fmaf(s.arm[w], drift[2], drift[w / 2]), speed = fmaf(s.arm[w], rate[2], rate[w / 2]);
    const float elastic = elastic_part(deformation, plastic[w], s.yields[w], is_accepted);
    force[w] = fmaf(s.hardening[w], deformation, fmaf(s.yielding[w], elastic, s.dashpot[w] * speed));
    if (is_accepted) peak[w] = fmaxf(peak[w], fabsf(deformation));
  }
  const float moment = fmaf(s.arm[0], force[0], fmaf(s.arm[1], force[1], fmaf(s.arm[2], force[2], s.arm[3] * force[3])));
  const float total[3] = {force[0] + force[1], force[2] + force[3], moment}, ground[3] = {ground_x, ground_y, 0};
  UNROLL for (int c = 0; c < 3; c++) {
    const float floor = (__shfl_sync(~0u, total[c], s.above) - total[c]) * (c == 2 ? s.inverse_inertia : s.inverse_mass);
    acceleration[c] = floor - (__shfl_sync(~0u, floor, s.below) + ground[c]);
  }
}

template <bool is_rk4> __global__ void __launch_bounds__(128) by_storey(Data x) {
  const int warp = (blockIdx.x * blockDim.x + threadIdx.x) / 32, thread = threadIdx.x % 32;
  const int i = min(thread % 11, storeys - 1), sample = warp * 3 + thread / 11, n0 = min(sample, x.samples - 1);
  const bool rests = thread % 11 == storeys;
  // Verlet: accelerations in units of 2 / h^2, velocities in units of 1 / h.
  const float h = x.step, unit = is_rk4 ? 1.f : 0.5f * h * h, per_step = is_rk4 ? 1.f : 1 / h;
  Storey s;
  UNROLL for (int w = 0; w < own_walls; w++) {
    const int wall = (own_walls * i + w) * x.samples + n0;
    const float k = rests ? 0.f : x.stiffness[wall];
    s.hardening[w] = x.hardening_ratio * k;
    s.yielding[w] = (1 - x.hardening_ratio) * k;
    s.dashpot[w] = x.stiffness_damping * per_step * k;
    s.yields[w] = x.yield_deformation[wall];
    s.arm[w] = x.arm[w * x.samples + n0];
  }
  s.inverse_mass = rests ? 0.f : x.inverse_mass[i * x.samples + n0] * unit;
  s.inverse_inertia = s.inverse_mass * x.inverse_gyration;
  s.above = i == storeys - 1 ? storeys : thread + 1;
  s.below = i == 0 || rests ? storeys : thread - 1;
  const float scale = i || rests ? 0.f : x.scale[n0] * unit, damping = x.mass_damping * (is_rk4 ? 1.f : 0.5f * h);
  float drift[3] = {}, rate[3] = {}, acceleration[3] = {}, plastic[4] = {}, peak[4] = {};
  float2 begin = x.motion[0];
  for (int n = 0; n < x.steps; n++) {
    const float2 end = x.motion[n + 1];
    if (!is_rk4) {
      float predicted[3];
      UNROLL for (int c = 0; c < 3; c++) {
        rate[c] += acceleration[c];
        drift[c] += rate[c];
        predicted[c] = rate[c] + acceleration[c];
      }
      accelerate<true>(s, drift, predicted, end.x * scale, end.y * scale, plastic, peak, acceleration);
      UNROLL for (int c = 0; c < 3; c++) {
        acceleration[c] = fmaf(-damping, predicted[c], acceleration[c]);
        rate[c] += acceleration[c];
      }
    } else {
      float sum_d[3], sum_v[3], d[3], v[3];
      const float x0 = begin.x * scale, y0 = begin.y * scale, x1 = end.x * scale, y1 = end.y * scale;
      accelerate<true>(s, drift, rate, x0, y0, plastic, peak, acceleration);
      UNROLL for (int c = 0; c < 3; c++) {
        acceleration[c] = fmaf(-damping, rate[c], acceleration[c]);
        sum_d[c] = rate[c];
        sum_v[c] = acceleration[c];
        d[c] = fmaf(0.5f * h, rate[c], drift[c]);
        v[c] = fmaf(0.5f * h, acceleration[c], rate[c]);
      }
      UNROLL for (int stage = 1; stage < 3; stage++) {
        accelerate<false>(s, d, v, 0.5f * (x0 + x1), 0.5f * (y0 + y1), plastic, peak, acceleration);
        const float reach = stage == 2 ? h : 0.5f * h;
        UNROLL for (int c = 0; c < 3; c++) {
          acceleration[c] = fmaf(-damping, v[c], acceleration[c]);
          sum_d[c] = fmaf(2.f, v[c], sum_d[c]);
          sum_v[c] = fmaf(2.f, acceleration[c], sum_v[c]);
          d[c] = fmaf(reach, v[c], drift[c]);
          v[c] = fmaf(reach, acceleration[c], rate[c]);
        }
      }
      accelerate<false>(s, d, v, x1, y1, plastic, peak, acceleration);
      UNROLL for (int c = 0; c < 3; c++) {
        acceleration[c] = fmaf(-damping, v[c], acceleration[c]);
        drift[c] = fmaf(h / 6, sum_d[c] + v[c], drift[c]);
        rate[c] = fmaf(h / 6, sum_v[c] + acceleration[c], rate[c]);
      }
    }
    begin = end;
  }
  if (is_rk4) UNROLL for (int w = 0; w < own_walls; w++) peak[w] = fmaxf(peak[w], fabsf(fmaf(s.arm[w], drift[2], drift[w / 2])));
  const bool is_finite = isfinite(drift[0] + drift[1] + drift[2]);
  if (!rests && sample < x.samples)
    UNROLL for (int w = 0; w < own_walls; w++) x.peaks[(own_walls * i + w) * x.samples + sample] = is_finite ? peak[w] : NAN;
}

// ---- a thread has a building --------------------------------------------------------------------------------------

constexpr int block = 64;

__global__ void __launch_bounds__(block, 4) by_thread(Data x) {
  extern __shared__ float table[];
  const int thread = threadIdx.x, n0 = min(blockIdx.x * block + thread, x.samples - 1);
  const float h = x.step, unit = 0.5f * h * h, damping = x.mass_damping * 0.5f * h;
  float inverse_mass[storeys], arm[own_walls], drift[3][storeys] = {}, rate[3][storeys] = {}, acceleration[3][storeys] = {};
  float plastic[storeys][own_walls] = {}, peak[storeys][own_walls] = {};
  UNROLL for (int wall = 0; wall < walls; wall++) {
    table[2 * (wall * block + thread)] = x.stiffness[wall * x.samples + n0];
    table[2 * (wall * block + thread) + 1] = x.yield_deformation[wall * x.samples + n0];
  }
  UNROLL for (int i = 0; i < storeys; i++) inverse_mass[i] = x.inverse_mass[i * x.samples + n0] * unit;
  UNROLL for (int w = 0; w < own_walls; w++) arm[w] = x.arm[w * x.samples + n0];
  const float scale = x.scale[n0] * unit;
  const unsigned base = __cvta_generic_to_shared(table) + 8 * thread;
  for (int n = 0; n < x.steps; n++) {
    const float2 end = x.motion[n + 1];
    float below[3] = {end.x * scale, end.y * scale, 0.f}, predicted[3], force[3] = {};
    UNROLL for (int i = 0; i <= storeys; i++) {  // floor i - 1 is complete once storey i is known
      float force_above[3] = {}, predicted_above[3], slow[3];
      if (i < storeys) {
        UNROLL for (int c = 0; c < 3; c++) {
          rate[c][i] += acceleration[c][i];
          drift[c][i] += rate[c][i];
          predicted_above[c] = rate[c][i] + acceleration[c][i];
          slow[c] = fmaf(x.hardening_ratio, drift[c][i], x.stiffness_damping / h * predicted_above[c]);
        }
        UNROLL for (int w = 0; w < own_walls; w++) {
          float k, yields;  // loaded in every step: the compiler would keep them in registers, which it does not have
          asm volatile("ld.shared.v2.f32 {%0, %1}, [%2];" : "=f"(k), "=f"(yields) : "r"(base + 8 * (own_walls * i + w) * block));
          const float deformation = fmaf(arm[w], drift[2][i], drift[w / 2][i]);
          const float elastic = elastic_part(deformation, plastic[i][w], yields, true);
          const float wall = k * fmaf(1 - x.hardening_ratio, elastic, fmaf(arm[w], slow[2], slow[w / 2]));
          peak[i][w] = fmaxf(peak[i][w], fabsf(deformation));
          force_above[w / 2] += wall;
          force_above[2] = fmaf(arm[w], wall, force_above[2]);
        }
      }
      UNROLL for (int c = 0; c < 3; c++) {
        if (i) {
          const float own = inverse_mass[i - 1] * (c == 2 ? x.inverse_gyration : 1.f);
          const float floor = (force_above[c] - force[c]) * own;
          acceleration[c][i - 1] = fmaf(-damping, predicted[c], floor - below[c]);
          rate[c][i - 1] += acceleration[c][i - 1];
          below[c] = floor;
        }
        force[c] = force_above[c];
        predicted[c] = predicted_above[c];
      }
    }
  }
  if (blockIdx.x * block + thread < x.samples)
    UNROLL for (int wall = 0; wall < walls; wall++) {
      const int i = wall / own_walls;
      const bool is_finite = isfinite(drift[0][i] + drift[1][i] + drift[2][i]);
      x.peaks[wall * x.samples + n0] = is_finite ? peak[i][wall % own_walls] : NAN;
    }
}

// Copies the arrays to the device, integrates all samples repeatedly for `timed_for` seconds, and copies the peaks back.
// Kernel 0: Verlet, a thread has a building; 1: Verlet, a thread has a storey; 2: RK4, a thread has a storey. Writes the
// least time of a run [s], the kernel's registers and its local memory [bytes]; returns an error of CUDA, or 0.
extern "C" int torsional_building(const float* stiffness, const float* yield_deformation, const float* inverse_mass,
                                  const float* arm, const float* scale, const float* motion, const double* constants,
                                  int steps, double step, int samples, int kernel, double timed_for, float* peaks,
                                  double* seconds, int* registers, int* local_bytes) {
  const size_t row = sizeof(float) * samples, sizes[7] = {walls * row, walls * row, storeys * row, own_walls * row,
                                                          row, sizeof(float2) * (steps + 1), walls * row};
  const float* given[6] = {stiffness, yield_deformation, inverse_mass, arm, scale, motion};
  float* device[7] = {};
  for (int k = 0; k < 7; k++) {
    if (const cudaError_t error = cudaMalloc(&device[k], sizes[k])) return error;
    if (k < 6) cudaMemcpy(device[k], given[k], sizes[k], cudaMemcpyHostToDevice);
  }
  const Data x = {device[0], device[1], device[2], device[3], device[4], (const float2*)device[5], device[6], samples,
                  steps, float(step), float(constants[0]), float(constants[1]), float(constants[2]), float(constants[3])};
  void (*const function)(Data) = kernel == 0 ? by_thread : kernel == 1 ? by_storey<false> : by_storey<true>;
  const int threads = kernel ? 128 : block, shared = kernel ? 0 : 2 * walls * block * (int)sizeof(float);
  const int blocks = kernel ? ((samples + 2) / 3 + 3) / 4 : (samples + block - 1) / block;
  cudaFuncSetAttribute(function, cudaFuncAttributeMaxDynamicSharedMemorySize, shared);
  cudaEvent_t start, end;
  cudaEventCreate(&start);
  cudaEventCreate(&end);
  *seconds = 1e30;
  double total = 0;
  for (int run = 0; run < 3 || total < timed_for; run++) {
    cudaEventRecord(start);
    function<<<blocks, threads, shared>>>(x);
    cudaEventRecord(end);
    if (const cudaError_t error = cudaEventSynchronize(end)) return error;
    float milliseconds;
    cudaEventElapsedTime(&milliseconds, start, end);
    total += milliseconds / 1e3;
    if (milliseconds / 1e3 < *seconds) *seconds = milliseconds / 1e3;
  }
  cudaFuncAttributes attributes;
  cudaFuncGetAttributes(&attributes, function);
  *registers = attributes.numRegs;
  *local_bytes = (int)attributes.localSizeBytes;
  cudaMemcpy(peaks, device[6], sizes[6], cudaMemcpyDeviceToHost);
  for (float* pointer : device) cudaFree(pointer);
  return cudaGetLastError();
}

extern "C" const char* error_text(int error) { return cudaGetErrorString((cudaError_t)error); }
