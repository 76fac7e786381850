//! What of this processor can change the last digits of a result.

/// Names of the vector instructions that linear algebra may choose from at run time on this processor: with others, sums are
/// rounded in another order.
pub fn vector_instructions() -> String {
    #[cfg(target_arch = "x86_64")]
    {
        macro_rules! found {
            ($($name:tt)*) => { [$(($name, is_x86_feature_detected!($name))),*] };
        }
        let found = found!("avx" "avx2" "fma" "avx512f" "avx512bw" "avx512cd" "avx512dq" "avx512vl");
        let names: Vec<&str> = found.into_iter().filter(|(_, found)| *found).map(|(name, _)| name).collect();
        names.join(" ")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        std::env::consts::ARCH.to_string()
    }
}
