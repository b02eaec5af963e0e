//! The readers that the targets call, which the tests call with the files of `tests/corpus`.

#[path = "../../tests/suite/readers.rs"]
pub mod readers;
