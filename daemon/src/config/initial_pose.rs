//! How a pose is written: a list of three numbers, or that it is unknown.

use std::fmt;

use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::sections::{InitialPose, UNKNOWN};

impl Serialize for InitialPose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Given(pose) => pose.serialize(serializer),
            Self::Unknown => serializer.serialize_str(UNKNOWN),
        }
    }
}

impl<'de> Deserialize<'de> for InitialPose {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Written)
    }
}

struct Written;

impl<'de> Visitor<'de> for Written {
    type Value = InitialPose;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "three numbers or \"{UNKNOWN}\"")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<InitialPose, E> {
        let known = (word == UNKNOWN).then_some(InitialPose::Unknown);
        known.ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(word), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<InitialPose, A::Error> {
        let mut pose = [0.0; 3];
        for (index, coordinate) in pose.iter_mut().enumerate() {
            let next = list.next_element()?;
            *coordinate = next.ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        match list.next_element::<IgnoredAny>()? {
            None => Ok(InitialPose::Given(pose)),
            Some(_) => Err(A::Error::invalid_length(pose.len() + 1, &self)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Place {
        pose: InitialPose,
    }

    #[test]
    fn it_reads_as_it_is_written_and_nothing_else_is_read() {
        for pose in [InitialPose::Unknown, InitialPose::Given([1.0, -2.5, 3.0])] {
            let written = toml::to_string(&Place { pose }).unwrap();
            assert_eq!(toml::from_str::<Place>(&written).unwrap(), Place { pose });
        }
        for wrong in ["\"somewhere\"", "[1, 2]", "[1, 2, 3, 4]", "7"] {
            assert!(toml::from_str::<Place>(&format!("pose = {wrong}")).is_err());
        }
    }
}
