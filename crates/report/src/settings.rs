//! What a walk is judged by.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};

/// The section `report` of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSettings {
    /// Largest distance of the real from the planned zero-moment point at which a walk still counts as the planned one (m), above 0 to 1.
    /// Half a sole's width is 65 mm; pushes of the shipped scenarios move it by 74 mm for a moment.
    pub zmp_error_max_m: f64,
}

impl Default for ReportSettings {
    fn default() -> Self {
        Self { zmp_error_max_m: 0.15 }
    }
}

/// What a limit may be (m): a metre away is another walk.
const ZMP_ERROR_MAX_M: Range = Range::above_zero_to(1.0);

/// Name of the file with these settings among a recording's.
const FILE: &str = "config/report.toml";

impl ReportSettings {
    /// Is every value one that judges?
    ///
    /// # Errors
    /// [`OutOfRange`] otherwise.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let demanded = ZMP_ERROR_MAX_M.demand("zmp_error_max_m", self.zmp_error_max_m, "0.15 (m) is the default");
        demanded.map_err(|error| error.under("report"))
    }

    /// Those of a recording's files; the default where it has none that can be used.
    pub(crate) fn recorded(files: &[(String, Vec<u8>)]) -> Self {
        let text = files.iter().find(|(name, _)| name == FILE).map(|(_, content)| String::from_utf8_lossy(content));
        let settings = text.and_then(|text| toml::from_str::<Self>(&text).ok());
        settings.filter(|settings| settings.check().is_ok()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_judge_nothing_are_refused() {
        for found in [0.0, -0.1, 1.5, f64::NAN, f64::INFINITY] {
            let refused = ReportSettings { zmp_error_max_m: found }.check().expect_err("no limit").to_string();
            assert!(refused.contains("`report.zmp_error_max_m` is") && refused.contains("at most 1"), "{refused}");
        }
        assert_eq!(ReportSettings::default().check(), Ok(()));
    }

    #[test]
    fn a_recording_is_judged_by_its_own_settings() {
        let file = |text: &str| [(FILE.to_string(), text.as_bytes().to_vec())];
        assert_eq!(ReportSettings::recorded(&file("zmp_error_max_m = 0.03")).zmp_error_max_m, 0.03);
        for foreign in ["zmp_error_max_m = 1e9", "zmp_error_max_m = \"wide\"", "= ="] {
            assert_eq!(ReportSettings::recorded(&file(foreign)), ReportSettings::default(), "{foreign}");
        }
        assert_eq!(ReportSettings::recorded(&[]), ReportSettings::default());
    }
}
