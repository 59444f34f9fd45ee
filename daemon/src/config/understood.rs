//! What `colocd check` says it understood: everything, in words and units, a line a subject.

mod estimator;
mod forecast;
mod gyro;
mod machine;
mod missing;
mod noise;
mod page;
mod robot;
mod sightings;
mod wheels;

use std::fmt;

use super::Config;
use page::Page;

/// A configuration, for the person who wrote it.
#[derive(Copy, Clone, Debug)]
pub struct Understood<'a>(pub &'a Config);

impl fmt::Display for Understood<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut page = Page::default();
        robot::write(self.0, &mut page);
        wheels::write(self.0, &mut page);
        gyro::write(self.0, &mut page);
        sightings::write(self.0, &mut page);
        estimator::write(self.0, &mut page);
        machine::write(self.0, &mut page);
        missing::write(self.0, &mut page);
        f.write_str(page.text())
    }
}
