//! The options of commands that change which lights a set-up has.

use crate::scene::Scene;
use crate::setup::{self, Setup};
use anyhow::{Context, Result, ensure};

/// Lights beside the one at work.
#[derive(clap::Args)]
pub struct Lamps {
    /// Add a light, written as --light is; all: every light of the scene that the set-up does not have yet. Can be given many
    /// times; a set-up takes up to 16 lights.
    #[arg(long, allow_hyphen_values = true, value_name = "LIGHT")]
    add_light: Vec<String>,
    /// Switch lights off, by their numbers from 1, separated by commas.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    lights_off: Vec<usize>,
    /// Switch lights on.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    lights_on: Vec<usize>,
    /// Show maps, visibility, truth and errors of the light of this number.
    #[arg(long, value_name = "NUMBER")]
    choose_light: Option<usize>,
}

impl Lamps {
    /// Whether a light is named by its number.
    pub fn chosen(&self) -> bool {
        self.choose_light.is_some() || !self.lights_off.is_empty() || !self.lights_on.is_empty()
    }

    /// Adds, switches and chooses, in this order.
    ///
    /// # Errors
    /// A light that is not there, or more than there may be.
    pub fn apply(&self, setup: &mut Setup, scene: &Scene) -> Result<()> {
        for text in &self.add_light {
            let adding = || format!("--add-light {text}");
            if text == "all" && !scene.lights.iter().any(|l| l.name == "all") {
                setup.add_all_lights(scene).with_context(adding)?;
            } else {
                let light = setup::parse_light(scene, text, setup.clock()).with_context(adding)?;
                setup.add_light(light).with_context(adding)?;
            }
        }
        for (option, numbers, on) in [("--lights-off", &self.lights_off, false), ("--lights-on", &self.lights_on, true)]
        {
            for number in numbers {
                setup.switch_light(place(setup, option, *number)?, on);
            }
        }
        if let Some(number) = self.choose_light {
            setup.choose_light(place(setup, "--choose-light", number)?)?;
        }
        Ok(())
    }
}

/// The place of the light of a number from 1.
fn place(setup: &Setup, option: &str, number: usize) -> Result<usize> {
    let count = setup.light_count();
    ensure!((1..=count).contains(&number), "{option} {number}: there is no such light; the set-up has 1 to {count}");
    Ok(number - 1)
}
