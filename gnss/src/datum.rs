//! The datum: as configured, as it was saved, or the mean of the first good fixes.

use coloc_shm_types::private::{NotPrivate, OwnFile};
use serde::{Deserialize, Serialize};

use crate::fix::Fix;
use crate::local::{Datum, LocalFrame};
use crate::section::DatumSection;

/// Longest file of a datum (bytes).
const LONGEST: u64 = 4096;

/// The common frame, or the way to it.
#[derive(Debug)]
pub enum Origin {
    /// It is known.
    Known(LocalFrame),
    /// It is being measured.
    Measuring(Mean),
}

/// Fixes whose mean will be the datum.
#[derive(Debug)]
pub struct Mean {
    first: [f64; 2],
    sum: [f64; 2],
    heights: (f64, u32),
    count: u32,
    wanted: u32,
    turned_rad: f64,
    file: Option<OwnFile>,
}

/// As it stands in the file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    fixes: u32,
}

/// Why a saved datum is not used.
#[derive(Debug, thiserror::Error)]
pub enum DatumError {
    /// The file is not ours alone.
    #[error("the datum: {0}")]
    Private(#[from] NotPrivate),
    /// There is something else in it.
    #[error("{path} holds no datum ({why}); remove it, and the datum is measured anew")]
    NoDatum {
        /// The file.
        path: String,
        /// What is wrong.
        why: String,
    },
}

impl Origin {
    /// As configured, else as saved in `file`, else to be measured and saved there.
    ///
    /// # Errors
    /// If the file holds no datum: another one would be another frame.
    pub fn begin(section: &DatumSection, file: Option<OwnFile>) -> Result<Self, DatumError> {
        if let Some((latitude_deg, longitude_deg)) = section.latitude_deg.zip(section.longitude_deg)
        {
            let datum = Datum {
                latitude_deg,
                longitude_deg,
                height_m: section.height_m,
                turned_rad: section.turned_rad,
            };
            // The configuration was checked.
            return LocalFrame::new(datum)
                .map(Self::Known)
                .ok_or_else(|| DatumError::NoDatum {
                    path: "[gnss.datum]".into(),
                    why: "it is no point of the earth".into(),
                });
        }
        if let Some(file) = &file
            && let Some(text) = file.read(LONGEST)?
        {
            return read(&text, section.turned_rad)
                .map(Self::Known)
                .map_err(|why| DatumError::NoDatum {
                    path: file.path().display().to_string(),
                    why,
                });
        }
        Ok(Self::Measuring(Mean {
            first: [0.0; 2],
            sum: [0.0; 2],
            heights: (0.0, 0),
            count: 0,
            wanted: section.fixes,
            turned_rad: section.turned_rad,
            file,
        }))
    }

    /// The frame, once it is known.
    #[must_use]
    pub fn frame(&self) -> Option<&LocalFrame> {
        match self {
            Self::Known(frame) => Some(frame),
            Self::Measuring(_) => None,
        }
    }

    /// How many good fixes it has, of those that it needs.
    #[must_use]
    pub fn fixes(&self) -> u32 {
        match self {
            Self::Known(_) => 0,
            Self::Measuring(mean) => mean.count,
        }
    }

    /// Takes in a good fix; once the datum is known by it, what is to be said of that.
    pub fn add(&mut self, fix: &Fix) -> Option<String> {
        let Self::Measuring(mean) = self else {
            return None;
        };
        mean.add(fix);
        let (frame, said) = mean.end()?;
        *self = Self::Known(frame);
        Some(said)
    }
}

fn read(text: &str, turned_rad: f64) -> Result<LocalFrame, String> {
    let saved: Saved = toml::from_str(text).map_err(|error| error.message().to_owned())?;
    let datum = Datum {
        latitude_deg: saved.latitude_deg,
        longitude_deg: saved.longitude_deg,
        height_m: saved.height_m,
        turned_rad,
    };
    LocalFrame::new(datum).ok_or_else(|| "it is no point of the earth".into())
}

impl Mean {
    fn add(&mut self, fix: &Fix) {
        if self.count == 0 {
            self.first = fix.place;
        }
        let [north, east] = [0, 1].map(|it| fix.place[it] - self.first[it]);
        // On the other side of the line where the days meet.
        let east = (east + 180.0).rem_euclid(360.0) - 180.0;
        self.sum = [self.sum[0] + north, self.sum[1] + east];
        self.count += 1;
        if let Some(height) = fix.height_m {
            self.heights = (self.heights.0 + height, self.heights.1 + 1);
        }
    }

    fn end(&self) -> Option<(LocalFrame, String)> {
        if self.count < self.wanted {
            return None;
        }
        let share = 1.0 / f64::from(self.count);
        let [latitude_deg, longitude_deg] = [0, 1].map(|it| self.first[it] + self.sum[it] * share);
        let height_m = self.heights.0 / f64::from(self.heights.1.max(1));
        let saved = Saved {
            latitude_deg,
            longitude_deg: (longitude_deg + 180.0).rem_euclid(360.0) - 180.0,
            height_m,
            fixes: self.count,
        };
        let frame = LocalFrame::new(Datum {
            latitude_deg: saved.latitude_deg,
            longitude_deg: saved.longitude_deg,
            height_m,
            turned_rad: self.turned_rad,
        })?;
        Some((frame, self.save(&saved)))
    }

    fn save(&self, saved: &Saved) -> String {
        let Saved {
            latitude_deg,
            longitude_deg,
            height_m,
            fixes,
        } = saved;
        let is = format!(
            "the datum is latitude_deg = {latitude_deg:.8}, longitude_deg = {longitude_deg:.8}, height_m = {height_m:.2}, the mean of \
             {fixes} fixes"
        );
        let Some(file) = &self.file else {
            return is;
        };
        let path = file.path().display();
        let text = toml::to_string(saved).map_err(|error| error.to_string());
        let written = text.and_then(|text| {
            let text = format!(
                "# The datum of coloc-gnss. Without this file it is measured anew.\n{text}"
            );
            (file.replace(text.as_bytes())).map_err(|error| error.to_string())
        });
        match written {
            Ok(()) => format!("{is}, saved in {path}"),
            Err(problem) => format!(
                "{is}; it could not be saved, so the next start measures another one: {problem}"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fix(latitude: f64, longitude: f64) -> Fix {
        Fix {
            place: [latitude, longitude],
            height_m: Some(100.0),
            ..Fix::default()
        }
    }

    fn section(fixes: u32) -> DatumSection {
        DatumSection {
            fixes,
            ..DatumSection::default()
        }
    }

    #[test]
    fn the_mean_is_saved_and_read_again() {
        let directory = tempfile::tempdir().unwrap();
        let file = || Some(OwnFile::named(&directory.path().join("datum.toml")).unwrap());
        let mut origin = Origin::begin(&section(2), file()).unwrap();
        assert_eq!(origin.add(&fix(10.0, 179.9)), None);
        assert!(origin.frame().is_none() && origin.fixes() == 1);
        let said = origin.add(&fix(11.0, -179.7)).unwrap();
        assert!(said.contains("saved in"), "{said}");
        let datum = origin.frame().unwrap().datum();
        assert!(
            (datum.latitude_deg - 10.5).abs() < 1e-9 && (datum.longitude_deg + 179.9).abs() < 1e-9
        );
        let again = Origin::begin(&section(2), file()).unwrap();
        assert_eq!(again.frame().unwrap().datum(), datum);
    }

    #[test]
    fn a_file_with_something_else_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("datum.toml");
        for text in [
            "",
            "latitude_deg = 1",
            "latitude_deg = 100\nlongitude_deg = 0\nheight_m = 0\nfixes = 1\n",
        ] {
            std::fs::write(&path, text).unwrap();
            let file = OwnFile::named(&path).unwrap();
            let refusal = Origin::begin(&section(2), Some(file))
                .unwrap_err()
                .to_string();
            assert!(refusal.contains("measured anew"), "{refusal}");
        }
    }

    #[test]
    fn what_is_configured_comes_first() {
        let section = DatumSection {
            latitude_deg: Some(1.0),
            longitude_deg: Some(2.0),
            ..section(1)
        };
        let origin = Origin::begin(&section, None).unwrap();
        assert!((origin.frame().unwrap().datum().longitude_deg - 2.0).abs() < 1e-12);
    }
}
