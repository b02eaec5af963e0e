#![no_main]
use shadowscope_fuzz::{readers, start};
libfuzzer_sys::fuzz_target!(init: start(), |data: &[u8]| readers::ply(data));
