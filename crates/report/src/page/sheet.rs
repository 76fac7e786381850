//! A page in the style of the others that holds tables and charts of whoever writes it: one file, nothing is requested.

use super::text::{html, json_for_html};
use serde_json::Value;

/// Curves over one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// Below it.
    pub caption: String,
    /// What the horizontal axis says; the vertical one counts, logarithmically.
    pub axis: String,
    /// Abscissae, ascending.
    pub x: Vec<f64>,
    /// Label and counts of each curve; zero draws nothing.
    pub curves: Vec<(String, Vec<u64>)>,
}

/// A table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Above it.
    pub title: String,
    /// Its head.
    pub head: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<String>>,
}

/// A whole page: a verdict, facts, tables, charts. `good`: whether the verdict is; `None`: neither.
#[must_use]
pub fn sheet(
    title: &str,
    verdict: (&str, Option<bool>),
    facts: &[(String, String)],
    tables: &[Table],
    charts: &[Chart],
) -> String {
    let class = verdict.1.map_or("open", |good| if good { "good" } else { "bad" });
    let facts: Vec<String> =
        facts.iter().map(|(name, value)| format!("{}: <b>{}</b>", html(name), html(value))).collect();
    let tables: String = tables.iter().map(table).collect();
    let drawn: Vec<Value> = charts
        .iter()
        .map(|chart| {
            serde_json::json!({
                "title": chart.title, "caption": chart.caption, "axis": chart.axis, "x": chart.x,
                "curves": chart.curves.iter().map(|(label, counts)| serde_json::json!({"label": label, "counts": counts})).collect::<Vec<_>>(),
            })
        })
        .collect();
    [
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">",
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">",
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; ",
        "style-src 'unsafe-inline'; img-src data:\">",
        &format!("<link rel=\"icon\" href=\"data:,\"><title>{}</title>\n<style>", html(title)),
        include_str!("../../assets/uplot.css"),
        include_str!("../../assets/page.css"),
        "</style></head><body>\n<header>",
        &format!(
            "<h1>{}</h1><p style=\"margin:0\"><span class=\"verdict {class}\">{}</span></p>",
            html(title),
            html(verdict.0)
        ),
        &format!("<p class=\"facts\">{}</p></header>\n<main>", facts.join(" · ")),
        &tables,
        "<div class=\"plots\" id=\"plots\"></div>",
        "<noscript><p class=\"note\">Charts need JavaScript. Tables do not.</p></noscript></main>\n",
        "<footer><details><summary>Made by Soleus with uPlot (MIT)</summary><pre>",
        &html(include_str!("../../assets/LICENSES")),
        "</pre></details></footer>\n<script id=\"charts\" type=\"application/json\">",
        &json_for_html(&Value::Array(drawn)),
        "</script>\n<script>",
        include_str!("../../assets/uplot.min.js"),
        "</script>\n<script>",
        include_str!("../../assets/sheet.js"),
        "</script></body></html>\n",
    ]
    .concat()
}

fn table(table: &Table) -> String {
    let cells = |tag: &str, row: &[String]| -> String {
        row.iter().map(|cell| format!("<{tag}>{}</{tag}>", html(cell))).collect()
    };
    let rows: String = table.rows.iter().map(|row| format!("<tr>{}</tr>", cells("td", row))).collect();
    format!(
        "<div class=\"box\" style=\"margin-top:16px;overflow-x:auto\"><h2>{}</h2><table><thead><tr>{}</tr></thead><tbody>{rows}</tbody></table></div>\n",
        html(&table.title),
        cells("th scope=\"col\"", &table.head).replace("</th scope=\"col\">", "</th>")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_holds_what_it_is_given_as_text_and_asks_for_nothing() {
        let hostile = "</script><b>x";
        let curve = (hostile.to_string(), vec![3, 0, 1]);
        let chart = Chart {
            title: "woke".to_string(),
            caption: String::new(),
            axis: "us".to_string(),
            x: vec![1.0, 2.0, 3.0],
            curves: vec![curve],
        };
        let rows = Table {
            title: "Criteria".to_string(),
            head: vec!["id".to_string()],
            rows: vec![vec![hostile.to_string()], vec!["A2".to_string()]],
        };
        let page =
            sheet("Latency", ("met", Some(true)), &[("load".to_string(), hostile.to_string())], &[rows], &[chart]);
        assert!(!page.contains(hostile) && page.contains("<td>&lt;/script&gt;&lt;b&gt;x</td>"), "it stays text");
        assert!(page.contains("<th scope=\"col\">id</th>") && page.contains("verdict good\">met"));
        let charts = &page[page.find("application/json\">").expect("charts") + 18..];
        let charts: Value = serde_json::from_str(&charts[..charts.find("</script>").expect("its end")]).expect("JSON");
        assert_eq!(charts[0]["curves"][0]["counts"], serde_json::json!([3, 0, 1]));
        assert!(page.contains("default-src 'none'"));
    }
}
