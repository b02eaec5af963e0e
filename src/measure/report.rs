use super::Record;
use crate::frame::Renderer;
use anyhow::Result;
use std::path::Path;
pub fn write(_: &[Record], _: &mut Renderer, _: &Path) -> Result<()> {
    todo!()
}
