#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| shadowscope_fuzz::readers::presets(data));
