// Cortex-M: SysTick counts down at the processor clock of the emulated board, 25 MHz, while `-icount shift=0` lets each
// instruction take 1 ns: 40 instructions a tick.

#include "../probe.hpp"

#include <array>

namespace trihedron::targets {
namespace {

constexpr std::uint32_t kInstructionsPerTick = 40;
constexpr std::uint32_t kTicks = 1U << 24;

volatile std::uint32_t& system_register(std::uintptr_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}
volatile std::uint32_t& control() { return system_register(0xE000E010); }
volatile std::uint32_t& reload() { return system_register(0xE000E014); }
volatile std::uint32_t& current() { return system_register(0xE000E018); }

constexpr std::size_t kPaintedWords = 64 * 1024 / sizeof(std::uint32_t);
constexpr std::uint32_t kPaint = 0xA5C3'96E1;
/// What lies next to the frame of the painter is its own and not painted.
constexpr std::size_t kOwnWords = 64;

volatile std::uint32_t* painted_end = nullptr;

}  // namespace

bool measures() { return true; }

void start_counting() {
  reload() = kTicks - 1;
  current() = 0;
  control() = 5;  // on, from the processor clock, without interrupt
}

std::uint32_t instructions() { return (kTicks - current()) & (kTicks - 1); }

std::uint32_t instructions_between(std::uint32_t before, std::uint32_t after) {
  return ((after - before) & (kTicks - 1)) * kInstructionsPerTick;
}

[[gnu::noinline]] void paint_stack() {
  painted_end = static_cast<volatile std::uint32_t*>(__builtin_frame_address(0));
  for (std::size_t i = kOwnWords; i < kPaintedWords; ++i) {
    *(painted_end - i) = kPaint;
  }
}

std::size_t stack_used() {
  std::size_t depth = kPaintedWords;
  while (depth > kOwnWords && *(painted_end - (depth - 1)) == kPaint) {
    --depth;
  }
  return depth * sizeof(std::uint32_t);
}

}  // namespace trihedron::targets
