//! The page of a walk: one file that needs nothing but a browser.
//!
//! Rust writes what is to be read (summary, settings, ground track) and packs the columns; `assets/page.js` draws figures and replay
//! from them. All libraries are embedded, a content security policy forbids every request.

mod body;
mod changes;
mod geometry;
mod logs;
mod pack;
mod plots;
mod replay;
mod sample;
mod sheet;
mod text;
mod track;
mod walk;

use crate::table::rows;
pub use logs::{LogLine, log_lines};
use pack::Packer;
use plots::Plot;
use recording::{ReadError, Recording};
use sample::Grid;
use serde_json::{Value, json};
pub use sheet::{Chart, Table, sheet};
use text::{html, json_for_html};
use walk::Walk;

/// A page larger than this is refused: browsers and mail servers will not take it (bytes).
const PAGE_MAX_BYTES: usize = 20_000_000;

/// What of a walk is shown.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PageSettings {
    /// From this walk time on (s).
    pub from_s: Option<f64>,
    /// Until this walk time (s).
    pub to_s: Option<f64>,
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It holds no tick.
    #[error("{name}: no tick is recorded{between}: there is nothing to show")]
    Empty {
        /// The recording.
        name: String,
        /// The window that was asked for, if any.
        between: String,
    },
    /// The page would be too large.
    #[error("the page would have {} MB, at most {} are useful: show a part of the walk with --from and --to (s)", .bytes / 1_000_000, PAGE_MAX_BYTES / 1_000_000)]
    TooLarge {
        /// Its size.
        bytes: usize,
    },
}

/// A page and what it says.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// The file's content.
    pub html: String,
    /// The figures in its summary, one per run.
    pub figures: Vec<crate::WalkFigures>,
}

/// The page of one recording, called `name`, with what its processes said if that is known ([`log_lines`]).
///
/// # Errors
/// [`PageError`].
pub fn page(recording: &Recording, name: &str, logs: &[LogLine], settings: &PageSettings) -> Result<Page, PageError> {
    let mut walk = Walk::read(recording, name)?;
    let marked = logs::marked(logs).map(|(tick, text)| walk::Event { tick, kind: "log", text });
    walk.events.extend(marked);
    walk.events.sort_by_key(|event| event.tick);
    write(&[walk], logs, settings)
}

/// The page of two recordings, one over the other.
///
/// # Errors
/// [`PageError`].
pub fn compare(recordings: [(&Recording, &str); 2], settings: &PageSettings) -> Result<Page, PageError> {
    let [first, second] = recordings;
    write(&[Walk::read(first.0, first.1)?, Walk::read(second.0, second.1)?], &[], settings)
}

fn write(walks: &[Walk], logs: &[LogLine], settings: &PageSettings) -> Result<Page, PageError> {
    let grid = Grid::over(walks, settings).ok_or_else(|| PageError::Empty {
        name: walks.iter().map(|walk| walk.name.as_str()).collect::<Vec<_>>().join(" and "),
        between: match (settings.from_s, settings.to_s) {
            (None, None) => String::new(),
            (from, to) => {
                format!(" between {} and {} s", from.unwrap_or(f64::NEG_INFINITY), to.unwrap_or(f64::INFINITY))
            }
        },
    })?;
    let mut packer = Packer::default();
    let plots = overlaid(walks);
    let plots: Vec<Value> =
        plots.into_iter().map(|(plot, runs)| plot_json(&plot, &runs, walks, &grid, &mut packer)).collect();
    let replays: Vec<Value> = walks.iter().map(|walk| replay::json(walk, &grid, &mut packer)).collect();
    let head = json!({
        "time": { "from": grid.from_s(), "step": grid.step_s(), "n": grid.count() },
        "plots": plots,
        "replays": replays,
        "joints": walks[0].body.joints,
        "swings": walks[0].swings.iter().map(|(foot, from, to)| json!([foot, from, to])).collect::<Vec<_>>(),
        "events": events(walks, &grid),
        "show": fall_s(&walks[0]).unwrap_or_else(|| grid.shown_first_s()),
    });
    let html = assemble(walks, logs, &head, &packer.finish());
    if html.len() > PAGE_MAX_BYTES {
        return Err(PageError::TooLarge { bytes: html.len() });
    }
    Ok(Page { html, figures: walks.iter().map(|walk| walk.figures.clone()).collect() })
}

/// Walk time shortly before a fall: what one wants to see first.
fn fall_s(walk: &Walk) -> Option<f64> {
    const BEFORE_S: f64 = 0.2;
    let fall = walk.events.iter().find(|event| event.kind == "fall")?;
    Some(walk.time_s(fall.tick) - BEFORE_S)
}

/// Each figure that any walk fills, with the run of each of its curves.
fn overlaid(walks: &[Walk]) -> Vec<(Plot, Vec<usize>)> {
    let mut all: Vec<(Plot, Vec<usize>)> = Vec::new();
    for (run, walk) in walks.iter().enumerate() {
        for mut plot in plots::plots(walk) {
            if walks.len() > 1 {
                plot.curves.iter_mut().for_each(|curve| curve.label = format!("{} {}", ["A", "B"][run], curve.label));
            }
            match all.iter_mut().find(|(known, _)| known.id == plot.id) {
                Some((known, runs)) => {
                    // One band is enough to see where the soles end.
                    if plot.band.is_some() && known.band.is_some() {
                        plot.curves.drain(..2);
                    }
                    runs.extend(plot.curves.iter().map(|_| run));
                    known.curves.extend(plot.curves);
                }
                None => {
                    let runs = vec![run; plot.curves.len()];
                    all.push((plot, runs));
                }
            }
        }
    }
    all
}

fn plot_json(plot: &Plot, runs: &[usize], walks: &[Walk], grid: &Grid, packer: &mut Packer) -> Value {
    let curves: Vec<Value> = plot
        .curves
        .iter()
        .zip(runs)
        .map(|(curve, run)| {
            let walk = &walks[*run];
            let data = packer.add(grid.extremes(&curve.values, walk.tick_zero).into_iter(), curve.step);
            let joint = curve.joints.as_ref().map(|joints| packer.add(grid.firsts(joints, walk.tick_zero).into_iter(), 1.0));
            json!({
                "label": curve.label, "color": curve.color.to_string(), "dashed": curve.dashed, "width": curve.width, "run": run,
                "data": data, "joint": joint,
            })
        })
        .collect();
    json!({
        "id": plot.id, "title": plot.title, "axis": plot.axis, "caption": plot.caption, "unit": plot.unit, "digits": plot.digits,
        "logarithmic": plot.logarithmic, "line": plot.line, "band": plot.band, "curves": curves,
    })
}

/// Events on the page.
const EVENTS_MAX: usize = 200;

fn events(walks: &[Walk], grid: &Grid) -> Vec<Value> {
    let mut events = Vec::new();
    for (run, walk) in walks.iter().enumerate() {
        let prefix = if walks.len() > 1 { ["A: ", "B: "][run] } else { "" };
        for event in &walk.events {
            let time = walk.time_s(event.tick);
            if grid.holds(time) && events.len() < EVENTS_MAX {
                events.push(json!({ "time": time, "kind": event.kind, "text": format!("{prefix}{}", event.text) }));
            }
        }
    }
    events
}

fn assemble(walks: &[Walk], logs: &[LogLine], head: &Value, data: &str) -> String {
    let title =
        if let [first, second] = walks { format!("{} and {}", first.name, second.name) } else { title(&walks[0]) };
    let mut out = String::with_capacity(data.len() + 900_000);
    let mut put = |part: &str| out.push_str(part);
    put("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">");
    put("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">");
    put("<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; ");
    put("style-src 'unsafe-inline'; img-src data:\">");
    put(&format!("<link rel=\"icon\" href=\"data:,\"><title>{}</title>\n<style>", html(&title)));
    put(include_str!("../../assets/uplot.css"));
    put(include_str!("../../assets/page.css"));
    put("</style></head><body>\n<header>");
    put(&format!("<h1>{}</h1>", html(&title)));
    for walk in walks {
        put(&header(walk, walks.len() > 1));
    }
    put("</header>\n<main><div class=\"top\"><div class=\"column\">");
    put(&summary(walks));
    if let Some(track) = track::track(&walks[0], walks.get(1)) {
        put("<figure><h2 id=\"h-track\">Ground track</h2>");
        put(&track);
        put("<figcaption>From above, metres. Soles where they stood: left and right. ");
        put("<span class=\"key\" style=\"color:var(--c)\"></span>centre of mass ");
        put("<span class=\"key\" style=\"color:var(--d)\"></span>zero-moment point ");
        put("<span class=\"key dashed\" style=\"color:var(--k)\"></span>planned");
        put(if walks.len() > 1 {
            "; the second run is dotted.</figcaption></figure>"
        } else {
            "</figcaption></figure>"
        });
    }
    put("</div><figure id=\"replay\"><h2 id=\"h-view\">Replay</h2>");
    put(
        "<canvas id=\"view\" tabindex=\"0\" role=\"img\" aria-labelledby=\"h-view\" aria-describedby=\"c-view\"></canvas>",
    );
    put(
        "<div class=\"bar\"><button id=\"play\" type=\"button\" aria-label=\"Play or pause\" aria-pressed=\"false\">▶</button>",
    );
    put("<input id=\"seek\" type=\"range\" min=\"0\" value=\"0\" step=\"1\" aria-label=\"Time\">");
    put(
        "<output id=\"clock\">0.00 s</output><label>speed <select id=\"rate\"><option>0.1</option><option>0.25</option>",
    );
    put("<option>0.5</option><option selected>1</option><option>2</option></select></label></div>");
    put("<figcaption id=\"c-view\">");
    put(replay::caption(&walks[0]));
    put(
        " Drag to turn, wheel to zoom. Space plays, arrow keys step by a frame; a click on a figure moves the replay there.</figcaption>",
    );
    put("<div class=\"events\" id=\"events\"></div></figure></div>\n<div class=\"plots\" id=\"plots\"></div>");
    put(&logs::table(logs));
    put(
        "<noscript><p class=\"note\">Figures and replay need JavaScript. Summary and ground track do not.</p></noscript></main>\n",
    );
    put(
        "<footer><p>Shaded in the figures: left or right foot in the air. Drag across a figure to zoom all of them, double-click to see ",
    );
    put("everything again.</p><details><summary>Made by Soleus with uPlot and three.js (MIT)</summary><pre>");
    put(&html(include_str!("../../assets/LICENSES")));
    put("</pre></details></footer>\n<script id=\"head\" type=\"application/json\">");
    put(&json_for_html(head));
    put("</script>\n<script id=\"data\" type=\"application/octet-stream\">");
    put(data);
    put("</script>\n<script>");
    put(include_str!("../../assets/uplot.min.js"));
    put("</script>\n<script>");
    put(include_str!("../../assets/replay.min.js"));
    put("</script>\n<script>");
    put(include_str!("../../assets/page.js"));
    put("</script></body></html>\n");
    out
}

/// What the run was, in its own words.
fn title(walk: &Walk) -> String {
    let scenario = walk.files.iter().find(|(name, _)| name == "config/scenario.toml");
    let table: Option<toml::Table> = scenario.and_then(|(_, text)| String::from_utf8_lossy(text).parse().ok());
    let title = table.as_ref().and_then(|table| table.get("title")).and_then(toml::Value::as_str);
    title.filter(|title| !title.trim().is_empty()).map_or_else(|| walk.name.clone(), str::to_string)
}

fn header(walk: &Walk, with_name: bool) -> String {
    let figures = &walk.figures;
    let class = match (figures.verdict, figures.verdict.is_good()) {
        (crate::Verdict::Unjudged, _) => "open",
        (_, true) => "good",
        (_, false) => "bad",
    };
    let mut out = String::new();
    if with_name {
        out += &format!("<p class=\"facts\"><b>{}</b></p>", html(&format!("{}: {}", walk.name, title(walk))));
    }
    out += &format!(
        "<p style=\"margin:0\"><span class=\"verdict {class}\">{}</span><span class=\"facts\">{}</span></p>",
        html(figures.verdict.word()),
        html(&figures.verdict_reason)
    );
    const SAID_ELSEWHERE: [&str; 6] = ["units", "log_time", "settings", "result", "distance_m", "fallen"];
    let facts: Vec<String> = walk
        .facts
        .iter()
        .filter(|(key, value)| !SAID_ELSEWHERE.contains(&key.as_str()) && !value.is_empty())
        .map(|(key, value)| format!("{}: <b>{}</b>", html(&key.replace('_', " ")), html(value)))
        .collect();
    out += &format!("<p class=\"facts\">{}</p>", facts.join(" · "));
    let changes = changes::changes(&walk.files);
    if !changes.is_empty() {
        let open = if changes.len() <= 6 { " open" } else { "" };
        let settings = if changes.len() == 1 { "setting differs" } else { "settings differ" };
        out += &format!(
            "<details class=\"changes\"{open}><summary>{} {settings} from the shipped</summary><ul>",
            changes.len()
        );
        for change in &changes {
            let shipped = change.shipped.as_ref().map(|shipped| format!(" <s>{}</s>", html(shipped)));
            let shipped = shipped.unwrap_or_default();
            out += &format!("<li><code>{} = {}</code>{shipped}</li>", html(&change.key), html(&change.value));
        }
        out += "</ul></details>";
    }
    out
}

fn summary(walks: &[Walk]) -> String {
    let tables: Vec<Vec<(String, String)>> = walks.iter().map(|walk| rows(&walk.figures, &walk.body.joints)).collect();
    let mut names: Vec<&String> = Vec::new();
    for (name, _) in tables.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut out = "<div class=\"box\"><table class=\"summary\" aria-label=\"Summary\">".to_string();
    if walks.len() > 1 {
        out += "<thead><tr><th></th>";
        for walk in walks {
            out += &format!("<th scope=\"col\">{}</th>", html(&walk.name));
        }
        out += "</tr></thead>";
    }
    out += "<tbody>";
    for name in names {
        out += &format!("<tr><th scope=\"row\">{}</th>", html(name));
        for table in &tables {
            let value = table.iter().find(|(known, _)| known == name).map_or("–", |(_, value)| value.as_str());
            out += &format!("<td>{}</td>", html(value));
        }
        out += "</tr>";
    }
    out + "</tbody></table></div>"
}

#[cfg(test)]
#[path = "../../tests/support/mod.rs"]
mod support;

#[cfg(test)]
mod tests {
    use super::*;
    use messages::topic;
    use pack::Packed;
    use support::{Kind, TICK_ZERO, recorded};

    fn between<'a>(html: &'a str, start: &str, end: &str) -> &'a str {
        let from = html.find(start).expect("it is there") + start.len();
        &html[from..from + html[from..].find(end).expect("it ends")]
    }

    /// Every column of a page by figure and label, as the browser unpacks them.
    fn columns(html: &str) -> Vec<(String, Vec<f64>)> {
        let head: Value = serde_json::from_str(between(html, "type=\"application/json\">", "</script>")).expect("JSON");
        let packed = |value: &Value| Packed {
            n: value["n"].as_u64().expect("a count") as usize,
            step: value["step"].as_f64().expect("a number"),
        };
        let (mut names, mut packs) = (Vec::new(), Vec::new());
        for plot in head["plots"].as_array().expect("a list") {
            for curve in plot["curves"].as_array().expect("a list") {
                names.push(format!(
                    "{} {}",
                    plot["id"].as_str().expect("a name"),
                    curve["label"].as_str().expect("a name")
                ));
                packs.push(packed(&curve["data"]));
                if !curve["joint"].is_null() {
                    names.push("joint".to_string());
                    packs.push(packed(&curve["joint"]));
                }
            }
        }
        let data = between(html, "type=\"application/octet-stream\">", "</script>");
        names.into_iter().zip(pack::tests::unpack(data, &packs)).collect()
    }

    #[test]
    fn numbers_in_the_page_are_the_recordings_within_half_a_step() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let recording = recorded(folder.path(), &Kind::default());
        let page = page(&recording, "test", &[], &PageSettings::default()).expect("a page");
        let columns = columns(&page.html);
        let column = |name: &str| &columns.iter().find(|(known, _)| known == name).expect("it is drawn").1;
        let truths = recording.messages(topic::TRUTH_ROBOT).expect("readable");
        let half_a_step = 0.005 + 1e-9;
        for truth in &truths {
            let index = truth.header.tick as usize;
            assert!((column("zmp-x real")[index] - 1e3 * truth.zmp_m[0]).abs() <= half_a_step, "{index}");
            assert!(
                (column("sink left real")[index] + 1e3 * truth.sole_position_m[0][2]).abs() <= half_a_step,
                "{index}"
            );
        }
        // The plan two ticks later: the recording's truth is 1 mm ahead of it everywhere.
        let com = column("com x");
        assert!(com[..2].iter().all(|value| value.is_nan()) && (com[700] - 1.0).abs() <= half_a_step, "{}", com[700]);
        assert_eq!(column("iterations estimator (Newton)")[TICK_ZERO as usize], 3.0);
        assert_eq!(page.figures, [crate::figures(&recording).expect("readable")]);
    }

    #[test]
    fn a_part_of_a_walk_can_be_shown_and_nothing_is_an_error() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let recording = recorded(folder.path(), &Kind::default());
        let part = PageSettings { from_s: Some(1.0), to_s: Some(2.0) };
        let columns = columns(&page(&recording, "test", &[], &part).expect("a page").html);
        assert_eq!(columns[0].1.len(), 201);
        let nothing = PageSettings { from_s: Some(1e4), to_s: None };
        let refused = page(&recording, "test", &[], &nothing).expect_err("no tick is there").to_string();
        assert!(refused.contains("between 10000 and inf s"), "{refused}");
    }
}
