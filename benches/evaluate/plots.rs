//! Draws figures 7 to 12 of the evaluation as SVG.

use std::error::Error;

use plotters::prelude::*;

use super::cases::{ERROR_TAUS, Evaluation, Implementation, TIMED_TAUS};

/// Width and height of each plot, pixels.
const SIZE: (u32, u32) = (960, 460);

/// Colours that remain distinguishable with colour blindness (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(240, 228, 66),
];

const FONT: (&str, u32) = ("sans-serif", 15);

type Plot = Result<String, Box<dyn Error>>;

/// Draws all plots. Returns (file name, SVG text) pairs.
///
/// # Errors
/// If a plot cannot be drawn.
pub(super) fn all(evaluation: &Evaluation) -> Result<Vec<(String, String)>, Box<dyn Error>> {
    let mut plots = vec![
        ("figure-7.svg".to_owned(), delta(evaluation)?),
        ("figure-12.svg".to_owned(), error(evaluation)?),
    ];
    let mut number = 8;
    for grid in evaluation.grids.timed() {
        for tau in TIMED_TAUS {
            plots.push((format!("figure-{number}.svg"), times(evaluation, grid, tau)?));
            number += 1;
        }
    }
    Ok(plots)
}

/// Draws one of figures 8 to 11: time to completion of each implementation, on a logarithmic axis.
fn times(evaluation: &Evaluation, grid: u32, tau: f32) -> Plot {
    let bars: Vec<(Implementation, f64)> = Implementation::ALL
        .into_iter()
        .filter_map(|implementation| {
            evaluation
                .timed(implementation, grid, tau)
                .map(|run| (implementation, run.report.timings_ms.total))
        })
        .collect();
    let (low, high) = decades(bars.iter().map(|bar| bar.1));
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let n = bars.len();
        let mut chart = ChartBuilder::on(&root)
            .caption(format!("Time to completion, g = {grid}, tau = {tau:e}"), ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(64)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..n as f64, (low..high).log_scale())?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(0)
            .y_desc("milliseconds")
            .label_style(FONT)
            .axis_desc_style(FONT)
            .y_label_formatter(&|y| format!("{y}"))
            .draw()?;
        for (k, (implementation, time)) in bars.iter().enumerate() {
            let (left, right) = (k as f64 + 0.15, k as f64 + 0.85);
            chart.draw_series([Rectangle::new([(left, low), (right, *time)], COLOURS[k].filled())])?;
            let label = format!("{time:.0} ms");
            chart.draw_series([Text::new(label, (left, time * 1.45), ("sans-serif", 15))])?;
            // Left edge of the plot area, and width of a bar with its gaps, pixels.
            let (edge, width) = (12 + 70, (SIZE.0 as i32 - 94) / n.max(1) as i32);
            let name = implementation.name().replace("conjugate gradients", "conjugate, gradients");
            for (line, part) in (0..).zip(name.split(", ")) {
                let place = (edge + width * k as i32 + width / 7, SIZE.1 as i32 - 66 + 17 * line);
                root.draw(&Text::new(part, place, ("sans-serif", 14)))?;
            }
        }
        root.present()?;
    }
    Ok(svg)
}

/// Draws figure 7: delta over time, with both axes logarithmic.
fn delta(evaluation: &Evaluation) -> Plot {
    let series: Vec<(Implementation, Vec<(f64, f64)>)> = Implementation::ALL
        .into_iter()
        .filter(|implementation| *implementation != Implementation::MultigridOneThread)
        .filter_map(|implementation| {
            let run = evaluation.delta_run(implementation)?;
            Some((
                implementation,
                run.delta_over_time().map(|(t, d)| (t.max(1e-3), f64::from(d).max(1e-12))).collect(),
            ))
        })
        .collect();
    let (left, right) = decades(series.iter().flat_map(|s| s.1.iter().map(|p| p.0)));
    let (low, high) = decades(series.iter().flat_map(|s| s.1.iter().map(|p| p.1)));
    lines(
        &format!("Delta over time, g = {}, tau = 1e-5", evaluation.grids.middle),
        ["milliseconds of solving", "delta (Eq. 2)"],
        [left, right],
        [low, high],
        &series
            .into_iter()
            .map(|(implementation, points)| (implementation.name().to_owned(), points))
            .collect::<Vec<_>>(),
        SeriesLabelPosition::UpperRight,
    )
}

/// Draws figure 12: mean error over tau, with a line for each method on each grid.
fn error(evaluation: &Evaluation) -> Plot {
    let mut series = Vec::new();
    for grid in evaluation.grids.all() {
        let points: Vec<(f64, f64)> = ERROR_TAUS
            .into_iter()
            .filter_map(|tau| {
                Some((f64::from(tau), evaluation.mean_rel(Implementation::PaperThreads, grid, tau)?))
            })
            .collect();
        series.push((format!("paper, g = {grid}"), points));
    }
    for grid in evaluation.grids.all() {
        if let Some(error) = evaluation.mean_rel(Implementation::MultigridThreads, grid, 1e-5) {
            // The embedded method is measured at one tau only, so its error is drawn as a horizontal line.
            let points = ERROR_TAUS.map(|tau| (f64::from(tau), error)).to_vec();
            series.push((format!("embedded, g = {grid}"), points));
        }
    }
    let (low, high) = decades(series.iter().flat_map(|s| s.1.iter().map(|p| p.1)));
    lines(
        "Mean reconstruction error",
        ["tau", "error over the cage's diagonal"],
        [8e-6, 1.3e-3],
        [low, high],
        &series,
        SeriesLabelPosition::MiddleLeft,
    )
}

fn lines(
    title: &str,
    [x_name, y_name]: [&str; 2],
    [left, right]: [f64; 2],
    [low, high]: [f64; 2],
    series: &[(String, Vec<(f64, f64)>)],
    labels: SeriesLabelPosition,
) -> Plot {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(80)
            .build_cartesian_2d((left..right).log_scale(), (low..high).log_scale())?;
        chart
            .configure_mesh()
            .x_desc(x_name)
            .y_desc(y_name)
            .light_line_style(WHITE)
            .label_style(FONT)
            .axis_desc_style(FONT)
            .x_label_formatter(&|x| format!("{x:.0e}"))
            .y_label_formatter(&|y| format!("{y:.0e}"))
            .draw()?;
        for (k, (name, points)) in series.iter().enumerate() {
            let style = COLOURS[k % COLOURS.len()].stroke_width(2);
            chart
                .draw_series(LineSeries::new(points.iter().copied(), style))?
                .label(name.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            if points.len() < 20 {
                chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, style.filled())))?;
            }
        }
        chart
            .configure_series_labels()
            .position(labels)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.25))
            .label_font(FONT)
            .draw()?;
        root.present()?;
    }
    Ok(svg)
}

/// Returns the powers of ten below and above all positive values.
fn decades(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        (0.1, 10.0)
    } else {
        (10f64.powf(low.log10().floor()), 10f64.powf((high * 1.5).log10().ceil()))
    }
}

#[cfg(test)]
mod tests {
    use super::decades;

    #[test]
    fn decades_enclose_the_values() {
        let (low, high) = decades([3.0, 250.0, 42.0].into_iter());
        assert!((low - 1.0).abs() < 1e-9 && (high - 1000.0).abs() < 1e-6, "{low} {high}");
    }
}
