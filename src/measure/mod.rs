//! How wrong techniques are, and what they cost.

mod accuracy;
pub mod advise;
pub mod analysis;
pub mod causes;
mod columns;
pub mod contour;
pub mod diagnosis;
pub mod metrics;
mod path_cost;
mod path_figures;
mod record;
pub mod report;
pub mod reproduce;
mod search;
pub mod softness;
mod space;
pub mod stability;
pub mod story;
mod sweep;
pub mod table;
mod temporal;
pub mod timing;

pub use accuracy::{accuracy, asked, errors, figures};
pub use columns::Column;
pub use metrics::Errors;
pub use path_cost::Cost;
pub use path_figures::Figure;
pub use record::{LightRow, Record, params_text, read, read_csv, read_json, tied, write, write_csv, write_json};
pub use space::{Axis, expand};
pub use sweep::{More, PLAIN, Shard, Step, run};
pub use timing::{Quartiles, STOPPED, Times, seconds_for};
