//! The walk seen from above, as the paper's figures 7a, 7b and 9a show it.

use gait::{GaitSettings, Plan, ankle_pose};
use nalgebra::Vector2;
use pattern::{Foothold, PhaseKind, Reference, Side, WalkPattern};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

type Panel<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Points = Vec<(f64, f64)>;

const ZMP: RGBColor = RGBColor(200, 30, 30);
const COM: RGBColor = RGBColor(20, 70, 180);
const LEFT: RGBColor = RGBColor(0, 130, 90);
const RIGHT: RGBColor = RGBColor(190, 110, 0);
const EDGE: RGBColor = RGBColor(120, 120, 120);

/// Width of the column beside the paths in which the legend stands (units of the canvas).
const LEGEND: f64 = 330.0;
/// Height of the panel of one step (units of the canvas).
const STEP_HEIGHT: u32 = 960;

/// A colour faded so that it stays behind the paths.
fn faint(color: RGBColor) -> RGBAColor {
    color.mix(0.35)
}

/// Three panels one below the other: paths, the feet's ZMPs in double support, one step.
///
/// # Errors
/// If the drawing library fails.
pub fn draw(plan: &Plan, settings: &GaitSettings) -> anyhow::Result<String> {
    let pattern = &plan.pattern;
    let samples: Vec<_> =
        (0..=(pattern.duration_s() / 0.005).ceil() as u64).map(|i| pattern.evaluate(i as f64 * 0.005)).collect();
    let footprints = footprints(plan, settings);
    let bounds = Bounds::around(footprints.iter().flat_map(|(_, sole, _)| sole.iter().copied()), 0.04);
    let step = step_panel(plan, settings, &samples);

    // The drawing library rounds to whole units: a canvas of 2200 keeps the paths smooth.
    let width = 2200;
    let height = |bounds: &Bounds| (bounds.aspect() * (f64::from(width - 160) - LEGEND)) as u32 + 220;
    let tall = height(&bounds).clamp(480, 4400);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (width, 2 * tall + STEP_HEIGHT)).into_drawing_area();
        root.fill(&WHITE)?;
        let (paths, rest) = root.split_vertically(tall);
        let (feet, one_step) = rest.split_vertically(tall);

        let weights = format!("lambda = {}, mu = {}", settings.cost.lambda, settings.cost.mu);
        let mut panel = chart(&paths, &format!("ZMP, COM and ankles, {weights}"), &bounds)?;
        draw_footprints(&mut panel, &footprints)?;
        for (side, color, name) in [(Side::Left, LEFT, "left ankle"), (Side::Right, RIGHT, "right ankle")] {
            let ankle: Points = samples
                .iter()
                .map(|r| ankle_pose(pattern, &r.feet[side.index()], r.t_s).translation)
                .map(|p| (p.x, p.y))
                .collect();
            line(&mut panel, ankle, color.stroke_width(2), Some(name))?;
        }
        line(&mut panel, samples.iter().map(|r| point(r.zmp.position)).collect(), ZMP.stroke_width(4), Some("ZMP"))?;
        line(&mut panel, samples.iter().map(|r| point(r.com.position)).collect(), COM.stroke_width(4), Some("COM"))?;
        legend(&mut panel)?;

        let mut panel = chart(&feet, "ZMP of each foot in double support", &bounds)?;
        draw_footprints(&mut panel, &footprints)?;
        for (side, color, name) in [(Side::Left, LEFT, "left foot"), (Side::Right, RIGHT, "right foot")] {
            for (i, run) in double_support_runs(&samples, side).into_iter().enumerate() {
                line(&mut panel, run, color.stroke_width(4), (i == 0).then_some(name))?;
            }
        }
        line(
            &mut panel,
            samples.iter().map(|r| point(r.zmp.position)).collect(),
            faint(ZMP).stroke_width(2),
            Some("ZMP"),
        )?;
        legend(&mut panel)?;

        let mut panel = chart(&one_step, &step.title, &step.bounds)?;
        outline(&mut panel, &step.sole, EDGE.stroke_width(4), Some("sole"))?;
        outline(&mut panel, &step.shrunk, EDGE.stroke_width(2), Some("sole less margin"))?;
        line(&mut panel, step.zmp, ZMP.stroke_width(4), Some("ZMP of the foot"))?;
        line(&mut panel, step.com, COM.stroke_width(4), Some("COM"))?;
        panel
            .draw_series([Cross::new((0.0, 0.0), 10, BLACK.stroke_width(4))])?
            .label("ankle")
            .legend(|(x, y)| Cross::new((x + 18, y), 10, BLACK.stroke_width(4)));
        legend(&mut panel)?;
        root.present()?;
    }
    Ok(svg)
}

fn point(p: Vector2<f64>) -> (f64, f64) {
    (p.x, p.y)
}

#[derive(Clone, Copy)]
struct Bounds {
    x: (f64, f64),
    y: (f64, f64),
}

impl Bounds {
    fn around(points: impl Iterator<Item = (f64, f64)>, room: f64) -> Self {
        let mut b = Self { x: (f64::INFINITY, f64::NEG_INFINITY), y: (f64::INFINITY, f64::NEG_INFINITY) };
        for (x, y) in points {
            b.x = (b.x.0.min(x), b.x.1.max(x));
            b.y = (b.y.0.min(y), b.y.1.max(y));
        }
        Self { x: (b.x.0 - room, b.x.1 + room), y: (b.y.0 - room, b.y.1 + room) }
    }

    fn aspect(&self) -> f64 {
        (self.y.1 - self.y.0) / (self.x.1 - self.x.0)
    }
}

/// Axes with the same scale in both directions, widened where the area is larger than the bounds, and to the right for the legend.
fn chart<'a, 'b>(
    area: &'a DrawingArea<SVGBackend<'b>, plotters::coord::Shift>,
    title: &str,
    bounds: &Bounds,
) -> anyhow::Result<Panel<'a, 'b>>
where
    'b: 'a,
{
    let (width, height) = area.dim_in_pixel();
    let (plot_width, plot_height) = (f64::from(width) - 160.0 - LEGEND, f64::from(height) - 180.0);
    let (dx, dy) = (bounds.x.1 - bounds.x.0, bounds.y.1 - bounds.y.0);
    let metres_per_pixel = (dx / plot_width).max(dy / plot_height);
    let widen = |(low, high): (f64, f64), pixels: f64| {
        let middle = (low + high) / 2.0;
        (middle - metres_per_pixel * pixels / 2.0)..(middle + metres_per_pixel * pixels / 2.0)
    };
    let x = widen(bounds.x, plot_width);
    let mut panel = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 36))
        .margin(20)
        .x_label_area_size(70)
        .y_label_area_size(100)
        .build_cartesian_2d(x.start..x.end + metres_per_pixel * LEGEND, widen(bounds.y, plot_height))?;
    panel
        .configure_mesh()
        .x_desc("x (m)")
        .y_desc("y (m)")
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .light_line_style(TRANSPARENT)
        .label_style(("sans-serif", 24))
        .draw()?;
    Ok(panel)
}

/// Metres on an axis: to the micrometre, with two decimals at least, and a zero without a sign where a tick misses it by rounding.
fn tick(metres: &f64) -> String {
    const MICROMETRES: f64 = 1e6;
    let text = format!("{:.6}", (metres * MICROMETRES).round() / MICROMETRES + 0.0);
    let cents = text.find('.').map_or(text.len(), |point| point + 3);
    let (shown, finer) = text.split_at(cents);
    shown.to_owned() + finer.trim_end_matches('0')
}

fn line(panel: &mut Panel<'_, '_>, points: Points, style: ShapeStyle, name: Option<&str>) -> anyhow::Result<()> {
    let series = panel.draw_series(LineSeries::new(points, style))?;
    if let Some(name) = name {
        series.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 36, y)], style));
    }
    Ok(())
}

fn outline(
    panel: &mut Panel<'_, '_>,
    corners: &[(f64, f64); 4],
    style: ShapeStyle,
    name: Option<&str>,
) -> anyhow::Result<()> {
    line(panel, vec![corners[0], corners[1], corners[2], corners[3], corners[0]], style, name)
}

fn legend<'a, 'b: 'a>(panel: &mut Panel<'a, 'b>) -> anyhow::Result<()> {
    panel
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(EDGE)
        .legend_area_size(50)
        .label_font(("sans-serif", 24))
        .draw()?;
    Ok(())
}

/// A foot, the corners of its sole and those of the part of it that the ZMP may use (m).
type Footprint = (Side, [(f64, f64); 4], [(f64, f64); 4]);

/// Every foothold once: side, sole, sole less the margin.
fn footprints(plan: &Plan, settings: &GaitSettings) -> Vec<Footprint> {
    let first = plan.pattern.phases[0].feet;
    let initial = Side::BOTH.map(|side| (side, first[side.index()].ankle_foothold));
    let margin = settings.limits.zmp_margin_m;
    (initial.iter().chain(&plan.landings))
        .map(|(side, foothold)| {
            (
                *side,
                sole(&plan.pattern, settings, *side, foothold, 0.0),
                sole(&plan.pattern, settings, *side, foothold, margin),
            )
        })
        .collect()
}

fn sole(pattern: &WalkPattern, settings: &GaitSettings, side: Side, ankle: &Foothold, margin: f64) -> [(f64, f64); 4] {
    let centre = pattern.sole_foothold(side.index(), ankle);
    let (x, y) = (settings.sole.length_m() / 2.0 - margin, settings.sole.width_m() / 2.0 - margin);
    [(x, y), (-x, y), (-x, -y), (x, -y)].map(|(x, y)| point(centre.offset(Vector2::new(x, y)).position()))
}

fn draw_footprints(panel: &mut Panel<'_, '_>, footprints: &[Footprint]) -> anyhow::Result<()> {
    for (side, sole, shrunk) in footprints {
        let color = if *side == Side::Left { LEFT } else { RIGHT };
        outline(panel, sole, faint(color).stroke_width(2), None)?;
        outline(panel, shrunk, color.mix(0.15).stroke_width(2), None)?;
    }
    Ok(())
}

/// One polyline per double support and foot.
fn double_support_runs(samples: &[Reference], side: Side) -> Vec<Points> {
    samples
        .chunk_by(|a, b| (a.kind == PhaseKind::SingleSupport) == (b.kind == PhaseKind::SingleSupport))
        .filter(|run| run[0].kind != PhaseKind::SingleSupport)
        .map(|run| run.iter().map(|r| point(r.feet[side.index()].zmp.position)).collect())
        .collect()
}

struct Step {
    title: String,
    bounds: Bounds,
    sole: [(f64, f64); 4],
    shrunk: [(f64, f64); 4],
    zmp: Points,
    com: Points,
}

/// The stance in the middle of the walk, from landing to lift-off, seen from its ankle in the axes of the foot.
fn step_panel(plan: &Plan, settings: &GaitSettings, samples: &[Reference]) -> Step {
    let number = plan.landings.len().div_ceil(2);
    let (side, foothold) = plan.landings[number - 1];
    let local = |p: Vector2<f64>| {
        let (sin, cos) = foothold.yaw_rad.sin_cos();
        let d = p - foothold.position();
        (cos * d.x + sin * d.y, cos * d.y - sin * d.x)
    };
    let stance = |r: &&Reference| {
        let foot = &r.feet[side.index()];
        foot.in_contact && foot.ankle_foothold == foothold
    };
    let sole_of =
        |margin| sole(&plan.pattern, settings, side, &foothold, margin).map(|(x, y)| local(Vector2::new(x, y)));
    let zmp: Points = samples.iter().filter(stance).map(|r| local(r.feet[side.index()].zmp.position)).collect();
    let com: Points = samples.iter().filter(stance).map(|r| local(r.com.position)).collect();
    let outline = sole_of(0.0);
    let bounds = Bounds::around(outline.iter().chain(&zmp).chain(&com).copied(), 0.02);
    Step {
        title: format!(
            "stance {number}, {} foot, seen from its ankle",
            if side == Side::Left { "left" } else { "right" }
        ),
        bounds,
        sole: outline,
        shrunk: sole_of(settings.limits.zmp_margin_m),
        zmp,
        com,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_decimals_they_need_and_zero_has_no_sign() {
        for (metres, text) in [
            (-1e-17, "0.00"),
            (0.1, "0.10"),
            (-0.15, "-0.15"),
            (0.005, "0.005"),
            (1000.3 - 0.1, "1000.20"),
            (-4e-7, "0.00"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(tick(&metres), text);
        }
    }
}
