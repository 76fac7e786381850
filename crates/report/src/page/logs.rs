//! What the processes said while they ran: the lines of their logs, which lie beside a recording and not in it.

use super::text::html;
use serde_json::Value;

/// Lines that a page shows; of more, the later ones are left out and counted.
const LINES_MAX: usize = 400;
/// Longest line that is shown whole (characters).
const LINE_MAX: usize = 400;

/// A line of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// When, in universal time, as it is written.
    pub time: String,
    /// Who.
    pub process: String,
    /// `INFO`, `WARN`, `ERROR`, ..; empty for what is no line of a log, as the words of a panic.
    pub level: String,
    /// What.
    pub text: String,
    /// The control tick it speaks of, if it begins with one.
    pub tick: Option<i64>,
}

impl LogLine {
    /// Whether it is about something that is not as it should be.
    fn matters(&self) -> bool {
        !matches!(self.level.as_str(), "INFO" | "DEBUG" | "TRACE")
    }
}

/// The lines of a process's log, in either format.
#[must_use]
pub fn log_lines(process: &str, log: &str) -> Vec<LogLine> {
    let mut lines: Vec<LogLine> = Vec::new();
    for line in log.lines().filter(|line| !line.trim().is_empty()) {
        let (time, level, text) = as_text(line).or_else(|| as_json(line)).unwrap_or_else(|| {
            let before = lines.last().map(|line| line.time.clone());
            (before.unwrap_or_default(), String::new(), line.to_string())
        });
        let tick = text.strip_prefix("tick ").and_then(|rest| rest.split(':').next()?.parse().ok());
        lines.push(LogLine { time, process: process.to_string(), level, text, tick });
    }
    lines
}

/// `2026-11-30T22:28:09.106674Z  INFO text`
fn as_text(line: &str) -> Option<(String, String, String)> {
    let (time, rest) = line.split_once(' ')?;
    let (level, text) = rest.trim_start().split_once(' ')?;
    let is_time = time.ends_with('Z') && time.contains('T') && time.starts_with(|c: char| c.is_ascii_digit());
    let is_level = ["TRACE", "DEBUG", "INFO", "WARN", "ERROR"].contains(&level);
    (is_time && is_level).then(|| (time.to_string(), level.to_string(), text.trim().to_string()))
}

/// `{"timestamp":"..","level":"INFO","fields":{"message":".."}}`
fn as_json(line: &str) -> Option<(String, String, String)> {
    let said: Value = serde_json::from_str(line).ok()?;
    let text = |value: &Value| value.as_str().map(str::to_string);
    Some((text(&said["timestamp"])?, text(&said["level"])?, text(&said["fields"]["message"])?.trim().to_string()))
}

/// What of the lines belongs on the time line: tick, and words.
pub(super) fn marked(lines: &[LogLine]) -> impl Iterator<Item = (i64, String)> {
    lines
        .iter()
        .filter(|line| line.matters())
        .filter_map(|line| Some((line.tick?, cut(&format!("{}: {}", line.process, line.text.split_once(": ")?.1)))))
}

/// All of them as a table, by time; empty without any.
pub(super) fn table(lines: &[LogLine]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let mut sorted: Vec<&LogLine> = lines.iter().collect();
    // What happened at one time stays in the order of the files.
    sorted.sort_by(|a, b| a.time.cmp(&b.time));
    let matters = lines.iter().filter(|line| line.matters()).count();
    let (open, of_them) = match matters {
        0 => ("", String::new()),
        1 => (" open", ", one warning".to_string()),
        _ => (" open", format!(", {matters} warnings")),
    };
    let mut out = format!(
        "<details class=\"box logs\"{open}><summary>What the processes said: {} lines{of_them}</summary><div><table>",
        lines.len()
    );
    for line in sorted.iter().take(LINES_MAX) {
        let class = if line.matters() { " class=\"bad\"" } else { "" };
        // The day is in the page's head.
        let time = line.time.split_once('T').map_or("", |(_, time)| time.trim_end_matches('Z'));
        out += &format!(
            "<tr{class}><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            html(time),
            html(&line.process),
            html(&line.level.to_lowercase()),
            html(&cut(&line.text))
        );
    }
    if sorted.len() > LINES_MAX {
        out += &format!("<tr><td></td><td></td><td></td><td>and {} more</td></tr>", sorted.len() - LINES_MAX);
    }
    out + "</table></div></details>\n"
}

fn cut(text: &str) -> String {
    let mut short: String = text.chars().take(LINE_MAX).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "\
2026-11-30T22:28:09.106674Z  INFO controller: ready
2026-11-30T22:28:11.000000Z  WARN tick 412: no usable step (Held), the joints are brought to rest
{\"timestamp\":\"2026-11-30T22:28:10.5Z\",\"level\":\"ERROR\",\"fields\":{\"message\":\"tick 300: <script>\"}}

thread 'main' panicked at src/main.rs:1:1
";

    #[test]
    fn lines_of_both_formats_are_read_and_others_kept() {
        let lines = log_lines("controller", LOG);
        let levels: Vec<&str> = lines.iter().map(|line| line.level.as_str()).collect();
        assert_eq!(levels, ["INFO", "WARN", "ERROR", ""]);
        assert_eq!(lines.iter().map(|line| line.tick).collect::<Vec<_>>(), [None, Some(412), Some(300), None]);
        assert_eq!(lines[3].time, lines[2].time, "a panic comes after what was said last");
        assert!(log_lines("controller", " \n").is_empty());
        let marked: Vec<_> = marked(&lines).collect();
        let held = "controller: no usable step (Held), the joints are brought to rest";
        assert_eq!(marked, [(412, held.to_string()), (300, "controller: <script>".to_string())]);
    }

    #[test]
    fn the_table_is_by_time_and_nothing_in_it_is_code() {
        let table = table(&log_lines("controller", LOG));
        assert!(table.contains("4 lines, 3 warnings") && table.contains(" open>"), "{table}");
        assert!(!table.contains("<script>") && table.contains("&lt;script&gt;"));
        assert!(table.find("300").expect("there") < table.find("412").expect("there"));
        let many = "2026-11-30T22:28:09.1Z  INFO x\n".repeat(LINES_MAX + 5);
        let many = super::table(&log_lines("planner", &many));
        assert!(many.contains("and 5 more") && !many.contains(" open>"));
        assert_eq!(super::table(&[]), "");
    }
}
