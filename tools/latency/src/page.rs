//! The page of a campaign.

use crate::campaign::{Measured, Round};
use crate::criteria::quantiles;
use crate::ticks::LOOP;
use lateness::Lateness;
use lateness::judge::{Criterion, Verdict, worst};
use report::{Chart, Table};

/// One file: verdict, machine, criteria, rounds, percentiles, histograms.
pub fn page(measured: &Measured, facts: &[(String, String)], criteria: &[Criterion], unusable: bool) -> String {
    let verdict = worst(criteria.iter().map(|criterion| &criterion.verdict));
    let verdict = match (unusable, &verdict) {
        (true, _) => ("machine unusable: neither pass nor fail", None),
        (_, Verdict::Met) => ("met", Some(true)),
        (_, Verdict::NotMet) => ("not met", Some(false)),
        (_, Verdict::NotJudged(_)) => ("met as far as judged", None),
    };
    report::sheet("Latency by the clock", verdict, facts, &tables(measured, criteria), &charts(measured))
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_string()).collect()
}

fn tables(measured: &Measured, criteria: &[Criterion]) -> Vec<Table> {
    let row = |criterion: &Criterion| {
        let Criterion { id, measure, accept, found, verdict } = criterion;
        vec![(*id).to_string(), measure.clone(), found.clone(), accept.clone(), verdict.to_string()]
    };
    let rounds = measured.valid.iter().chain(&measured.invalid);
    let mut figures = Vec::new();
    for process in LOOP {
        for (figure, lateness) in measured.figures(process) {
            figures.push(vec![process.to_string(), figure.to_string(), quantiles(&lateness)]);
        }
    }
    vec![
        Table {
            title: "Criteria".to_string(),
            head: words(&["", "measured", "found", "accepted", "verdict"]),
            rows: criteria.iter().map(row).collect(),
        },
        Table {
            title: "Rounds".to_string(),
            head: words(&["what happened"]),
            rows: rounds.map(|round: &Round| vec![round.line()]).collect(),
        },
        Table {
            title: "All valid rounds together".to_string(),
            head: words(&["process", "figure", "microseconds"]),
            rows: figures,
        },
    ]
}

fn charts(measured: &Measured) -> Vec<Chart> {
    let mut charts = Vec::new();
    for process in LOOP {
        let (cycles, reference) = (measured.pooled(process), measured.pooled_reference(process));
        charts.push(chart(
            &format!("{process}: from the tick's time"),
            "Its wake-up and its answer, beside the wake-up of the reference thread on its core.",
            &[("woke", &cycles.woke), ("published", &cycles.published), ("reference", &reference)],
        ));
    }
    let processor = LOOP.map(|process| (process.word(), measured.pooled(process).processor));
    let processor: Vec<(&str, &Lateness)> = processor.iter().map(|(name, lateness)| (*name, lateness)).collect();
    charts.push(chart("Time of the processor in a cycle", "By the thread's own clock.", &processor));
    let hand_over = measured.hand_over();
    let wakes = [
        ("state to controller", &hand_over),
        ("message", &measured.wakes.event),
        ("message, one core", &measured.wakes.event_on_one_core),
        ("futex", &measured.wakes.futex),
    ];
    charts.push(chart("One thread wakes another", "Sent to received, 200 a second, SCHED_FIFO.", &wakes));
    charts
}

fn chart(title: &str, caption: &str, curves: &[(&str, &Lateness)]) -> Chart {
    let mut edges: Vec<u64> =
        curves.iter().flat_map(|(_, lateness)| lateness.buckets().map(|(edge, _)| edge)).collect();
    edges.sort_unstable();
    edges.dedup();
    let counts = |lateness: &Lateness| {
        let mut counts = vec![0; edges.len()];
        for (edge, count) in lateness.buckets() {
            let place = edges.binary_search(&edge).expect("an edge of one of the curves");
            counts[place] += count;
        }
        counts
    };
    Chart {
        title: title.to_string(),
        caption: caption.to_string(),
        axis: "microseconds".to_string(),
        // A logarithmic axis has no zero.
        x: edges.iter().map(|edge| (*edge).max(100) as f64 * 1e-3).collect(),
        curves: curves.iter().map(|(name, lateness)| ((*name).to_string(), counts(lateness))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_share_one_axis_and_lose_no_sample() {
        let (one, other) = (Lateness::of([10_000, 10_000, 50_000]), Lateness::of([50_000, 900_000]));
        let chart = chart("t", "c", &[("one", &one), ("other", &other)]);
        assert_eq!(chart.x.len(), 3);
        assert!(chart.x.is_sorted());
        assert_eq!(chart.curves[0].1, [2, 1, 0]);
        assert_eq!(chart.curves[1].1, [0, 1, 1]);
    }

    #[test]
    fn a_campaign_without_rounds_has_a_page_that_claims_nothing() {
        let page = page(&Measured::default(), &[], &crate::criteria::judge(&Measured::default(), false), true);
        assert!(page.contains("machine unusable") && page.contains("not judged") && !page.contains("verdict good"));
    }
}
