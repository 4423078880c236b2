//! What the targets for cargo-fuzz have in common. The functions that they call are in the crate `yfslam-fuzz`.

#[doc(hidden)]
pub use libfuzzer_sys;
use libfuzzer_sys::Corpus;

/// Runs a target. Inputs that are longer than the target says do not stay in the corpus, because they only take time.
pub fn run(name: &str, bytes: &[u8]) -> Corpus {
    let target = yfslam_fuzz::target(name).unwrap_or_else(|| panic!("there is no target {name}"));
    if bytes.len() > target.max_length {
        return Corpus::Reject;
    }
    let _ = (target.run)(bytes);
    Corpus::Keep
}

/// Makes a target for cargo-fuzz of the target of this name.
#[macro_export]
macro_rules! fuzz {
    ($name:literal) => {
        $crate::libfuzzer_sys::fuzz_target!(|bytes: &[u8]| -> $crate::libfuzzer_sys::Corpus {
            $crate::run($name, bytes)
        });
    };
}
