// Vector table and reset of the Cortex-M7. The reset handler switches the floating-point unit on and jumps to the start
// of newlib, which zeroes .bss, opens the host's files (semihosting), runs the constructors and calls main(). Any fault
// ends the program with a failure instead of hanging the emulator.

#include <cstdint>
#include <cstdlib>

extern "C" {

extern std::uint32_t stack_top;  // of the linker script
[[noreturn]] void _start();

[[noreturn]] void on_reset() {
  auto& coprocessor_access = *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88);
  coprocessor_access = coprocessor_access | (0xFU << 20);  // CP10 and CP11, full access
  asm volatile("dsb\n isb");
  _start();
}

[[noreturn]] void on_fault() {
  // Semihosting SYS_EXIT with a reason other than ADP_Stopped_ApplicationExit.
  asm volatile("mov r0, #0x18\n ldr r1, =0x20023\n bkpt 0xab" ::: "r0", "r1", "memory");
  for (;;) {
  }
}

using Handler = void (*)();
struct VectorTable {
  std::uint32_t* initial_stack;
  Handler handlers[15];  // reset, NMI, faults, … , SysTick
};

[[gnu::section(".vectors"), gnu::used]] const VectorTable vector_table = {
    &stack_top,
    {on_reset, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault,
     on_fault, on_fault, on_fault, on_fault}};
}
