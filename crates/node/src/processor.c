/* Whether this processor can run what was built for it. Built for any x86-64 processor, and run before anything else: the first
   instruction that an older one does not know would end the process by SIGILL, without a word. */

#include <unistd.h>

/* As `node::ExitCode::Start`; a test compares them. */
enum { CANNOT_START = 3 };

__attribute__((constructor)) static void soleus_require_processor(void) {
    static const char said[] =
        "error: this processor has no AVX2, FMA or BMI2, and Soleus was built for one that has (x86-64-v3, every x86-64 "
        "processor since 2013). Build it for yours: remove `target-cpu=x86-64-v3` from .cargo/config.toml\n";
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2")) {
        return;
    }
    if (write(STDERR_FILENO, said, sizeof said - 1) < 0) {
        /* Nobody listens; the code says it, too. */
    }
    _exit(CANNOT_START);
}
