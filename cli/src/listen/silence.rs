//! Saying why a robot is not heard: once, and again when it is for another reason.

/// Of one silence.
#[derive(Debug, Default)]
pub(super) struct Silence {
    seen: Option<String>,
    said: Option<String>,
}

impl Silence {
    /// What is to be said of it when it is noticed.
    pub(super) fn begins(&mut self, why: String) -> Option<String> {
        let is_new = self.said.as_ref() != Some(&why);
        self.said = Some(why.clone());
        is_new.then_some(why)
    }

    /// The same later on: a reason counts when it was there twice in a row, as who is just starting has not spoken yet.
    pub(super) fn goes_on(&mut self, why: String) -> Option<String> {
        let again = self.seen.replace(why.clone()).as_ref() == Some(&why);
        again.then(|| self.begins(why))?
    }
}

#[cfg(test)]
mod tests {
    use super::Silence;

    #[test]
    fn a_reason_is_said_once_and_another_one_when_it_lasts() {
        let mut silence = Silence::default();
        let said = |text: &str| Some(text.to_owned());
        assert_eq!(silence.begins("stopped".into()), said("stopped"));
        assert_eq!(silence.goes_on("stopped".into()), None);
        assert_eq!(silence.goes_on("stopped".into()), None);
        assert_eq!(silence.goes_on("gone".into()), None);
        assert_eq!(silence.goes_on("starting".into()), None);
        assert_eq!(silence.goes_on("gone".into()), None);
        assert_eq!(silence.goes_on("gone".into()), said("gone"));
        assert_eq!(silence.goes_on("gone".into()), None);
    }
}
