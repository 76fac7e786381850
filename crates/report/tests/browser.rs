//! The page in a browser: what a person sees, whatever the walk was and whatever the browser lacks. Skipped loudly without Chromium.

mod support;

#[path = "support/browser.rs"]
mod chromium;

use chromium::{Browser, program};
use report::{PageSettings, compare, page};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use support::{Kind, recorded};

/// The page of a walk in a file.
fn written(folder: &Path, kind: &Kind) -> PathBuf {
    let page = page(&recorded(folder, kind), "test", &[], &PageSettings::default()).expect("a page");
    let path = folder.join("report.html");
    std::fs::write(&path, page.html).expect("room");
    path
}

/// Every canvas has more than one colour.
const ALL_DRAWN: &str = "[...document.querySelectorAll('.uplot canvas')].every((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let first = null;
    for (let i = 0; i < data.length; i += 4) {
        const colour = `${data[i]},${data[i + 1]},${data[i + 2]},${data[i + 3]}`;
        if (first === null) first = colour;
        else if (colour !== first) return true;
    }
    return false;
})";

/// A sum over the replay's pixels that changes with any of them.
const REPLAY_SUM: &str = "(() => {
    const view = document.getElementById('view'), copy = document.createElement('canvas');
    copy.width = view.width; copy.height = view.height;
    const pen = copy.getContext('2d');
    pen.drawImage(view, 0, 0);
    const { data } = pen.getImageData(0, 0, copy.width, copy.height);
    let sum = 0;
    for (let i = 0; i < data.length; i++) sum = (sum * 31 + data[i]) | 0;
    return sum;
})()";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_walk_is_drawn_played_and_fetches_nothing() {
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = written(folder.path(), &Kind { is_pushed: true, ..Kind::default() });
    let size = std::fs::metadata(&path).expect("written").len();
    assert!(size < 1_000_000, "{size} bytes");
    // A machine without a graphics processor draws in software.
    let mut browser =
        Browser::start(&program, &["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]);
    browser.open_ready(&path, "#t=0");
    assert_eq!(browser.complaints, [] as [String; 0]);
    let fetched: Vec<_> = browser.requests.iter().filter(|url| !url.starts_with("data:")).collect();
    assert_eq!(fetched.len(), 1, "{fetched:?}");
    let figures = number(&browser.evaluate("document.querySelectorAll('.uplot canvas').length"));
    assert!(figures >= 12.0, "{figures} figures");
    assert_eq!(browser.evaluate(ALL_DRAWN), json!(true));
    assert!(browser.evaluate("document.querySelector('.changes').textContent").to_string().contains("test_only = 3"));
    assert!(browser.evaluate("document.getElementById('events').textContent").to_string().contains("push of 80 N"));

    if browser.evaluate("!document.getElementById('no-view')") == json!(true) {
        let before = browser.evaluate(REPLAY_SUM);
        browser.evaluate("location.hash = '#t=6'");
        browser.until("document.getElementById('clock').textContent === '6.00 s'");
        assert_ne!(browser.evaluate(REPLAY_SUM), before, "the robot has not moved");
    } else {
        eprintln!("SKIPPED: this Chromium draws no WebGL, not even in software: the replay's pixels were not compared");
    }
    // The slider, then the keys.
    browser.evaluate("(() => { const s = document.getElementById('seek'); s.value = s.max; s.dispatchEvent(new Event('input')); })()");
    let end_s = number(&browser.evaluate("parseFloat(document.getElementById('clock').textContent)"));
    assert!((end_s - 7.48).abs() < 0.021, "{end_s}");
    browser.press("ArrowLeft", 37);
    let back_s = number(&browser.evaluate("parseFloat(document.getElementById('clock').textContent)"));
    assert!((end_s - back_s - 0.02).abs() < 1e-9, "{back_s}");
    browser.press(" ", 32);
    browser.until("document.getElementById('play').getAttribute('aria-pressed') === 'true'");
    browser.press(" ", 32);
    browser.until("document.getElementById('play').getAttribute('aria-pressed') === 'false'");
    assert_eq!(browser.complaints, [] as [String; 0]);

    // A phone, then the dark.
    browser.size(420, 900);
    browser.until("document.documentElement.scrollWidth <= 420");
    let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
    browser.call("Emulation.setEmulatedMedia", dark);
    browser.until("getComputedStyle(document.body).backgroundColor === 'rgb(19, 21, 24)'");
    assert_eq!(browser.complaints, [] as [String; 0]);
}

#[test]
fn falls_early_ends_and_missing_truth_have_a_page() {
    let Some(program) = program() else { return };
    let mut browser = Browser::start(&program, &["--disable-gpu"]);
    for (kind, told, figures) in [
        (Kind { falls: true, ..Kind::default() }, "the robot falls: tilted too far", 12),
        (Kind { ends_early: true, ..Kind::default() }, "ended early", 12),
        (Kind { has_truth: false, ..Kind::default() }, "no truth", 6),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        browser.open_ready(&written(folder.path(), &kind), "");
        let text = browser.evaluate("document.body.innerText").to_string();
        assert!(text.contains(told), "no `{told}` in {text}");
        let drawn = number(&browser.evaluate("document.querySelectorAll('.uplot canvas').length"));
        assert!(drawn >= f64::from(figures), "{told}: {drawn} figures");
        assert!(browser.evaluate("!!document.querySelector('svg.track polygon')") == json!(true), "{told}: no track");
        assert_eq!(browser.complaints, [] as [String; 0], "{told}");
    }
}

#[test]
fn without_webgl_there_is_a_sentence_and_everything_else() {
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = written(folder.path(), &Kind::default());
    let mut browser = Browser::start(&program, &["--disable-3d-apis", "--disable-gpu"]);
    browser.open_ready(&path, "");
    assert!(browser.evaluate("document.getElementById('no-view').textContent").to_string().contains("needs WebGL"));
    assert_eq!(browser.evaluate(ALL_DRAWN), json!(true));
}

#[test]
fn without_javascript_there_are_summary_and_ground_track() {
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = written(folder.path(), &Kind::default());
    let mut browser = Browser::start(&program, &["--disable-gpu"]);
    browser.call("Emulation.setScriptExecutionDisabled", json!({ "value": true }));
    browser.open(&path, "");
    browser.until("!!document.querySelector('noscript') && document.querySelectorAll('.summary tr').length > 8");
    assert!(number(&browser.evaluate("document.querySelector('svg.track').getBoundingClientRect().height")) > 50.0);
    assert!(browser.evaluate("document.querySelector('noscript').innerText").to_string().contains("need JavaScript"));
}

#[test]
fn a_hostile_title_is_a_title() {
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let title = "</script><script>document.title='taken'</script><img src=x onerror=alert(1)>";
    let path = written(folder.path(), &Kind { title: title.to_string(), ..Kind::default() });
    let mut browser = Browser::start(&program, &["--disable-gpu"]);
    browser.open_ready(&path, "");
    assert_eq!(browser.evaluate("document.title"), json!(title));
    assert_eq!(browser.evaluate("document.querySelector('h1').textContent"), json!(title));
    assert_eq!(browser.evaluate("document.querySelectorAll('h1 *, img').length"), json!(0));
    assert_eq!(browser.complaints, [] as [String; 0]);
}

#[test]
fn two_walks_lie_over_each_other() {
    let Some(program) = program() else { return };
    let folders = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let first = recorded(folders[0].path(), &Kind::default());
    let second = recorded(folders[1].path(), &Kind { falls: true, ..Kind::default() });
    let page = compare([(&first, "with"), (&second, "without")], &PageSettings::default()).expect("a page");
    assert_eq!(page.figures.len(), 2);
    let path = folders[0].path().join("compare.html");
    std::fs::write(&path, page.html).expect("room");
    let mut browser = Browser::start(&program, &["--disable-gpu"]);
    browser.open_ready(&path, "");
    let curves = browser.evaluate("document.querySelector('#figure-com .u-legend').textContent").to_string();
    assert!(curves.contains("A x") && curves.contains("B z"), "{curves}");
    let heads =
        browser.evaluate("[...document.querySelectorAll('.summary thead th')].map((th) => th.textContent).join()");
    assert_eq!(heads, json!(",with,without"));
    assert_eq!(browser.complaints, [] as [String; 0]);
}
