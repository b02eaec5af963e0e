//! The readers that the targets call, which the tests call with the files of `tests/corpus`.

#[path = "../../tests/suite/readers.rs"]
pub mod readers;

/// Lets what is spread over threads run on this one: to hand it over would take longer than most files do.
pub fn start() {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    alone.build_global().expect("the first thread pool");
}
