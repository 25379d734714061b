#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| antumbra_fuzz::arrangement(bytes));
