//! Whether a page of the documentation says what is so.

/// A page, or a chapter of it.
#[derive(Copy, Clone, Debug)]
pub struct Page {
    /// Where it is.
    pub path: &'static str,
    /// The heading with which the chapter begins; nothing for the whole page.
    pub chapter: &'static str,
    /// The words between which its settings stand, in comments: `<!-- settings -->`, `<!-- end of settings -->`.
    pub settings: &'static str,
    /// What writes it anew.
    pub written_by: &'static str,
}

impl Page {
    fn text(&self) -> String {
        std::fs::read_to_string(self.path).unwrap()
    }

    /// From its heading on.
    #[must_use]
    pub fn chapter(&self) -> String {
        let text = self.text();
        let (_, chapter) = text.split_once(self.chapter).unwrap();
        chapter.into()
    }

    /// Its settings are `current`; they are written if that is asked for.
    pub fn assert_settings(&self, current: &str) {
        let text = self.text();
        let begin = format!("<!-- {} -->\n", self.settings);
        let end = format!("<!-- end of {} -->", self.settings);
        let (before, rest) = text.split_once(&begin).unwrap();
        let (_, after) = rest.split_once(&end).unwrap();
        let current = format!("{before}{begin}{current}{end}{after}");
        if std::env::var_os("COLOC_WRITE").is_some() {
            std::fs::write(self.path, &current).unwrap();
        }
        let (written_by, path) = (self.written_by, self.path);
        assert!(
            self.text() == current,
            "COLOC_WRITE=1 {written_by} writes {path} anew"
        );
    }

    /// Its first example of a configuration.
    #[must_use]
    pub fn example(&self) -> String {
        let chapter = self.chapter();
        let (_, rest) = chapter.split_once("```toml\n").unwrap();
        let (text, _) = rest.split_once("```").unwrap();
        text.into()
    }

    /// It says what each of these is.
    pub fn assert_names(&self, names: impl IntoIterator<Item = &'static str>) {
        let chapter = self.chapter();
        for name in names {
            assert!(chapter.contains(&format!("`{name}`")), "{name}");
        }
    }
}
