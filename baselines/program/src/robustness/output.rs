//! The results as tables, CSV and named figures.

use std::fmt::Write as _;

use baselines::Estimate;
use baselines::robustness::SuccessAt;

use super::Args;
use super::measured::{CRITICAL, Measured, Pair, Rates, TIMES};
use crate::shared::json::Metric;

/// Prints a table for each policy, and what sums it up, and then the pairs.
pub fn print(args: &Args, measured: &[Measured], pairs: &[Pair]) -> anyhow::Result<()> {
    for measured in measured {
        let rates = Rates::of(measured)?;
        say!(
            "{}, {}, {} episodes for each value; 95 % intervals",
            args.env_id,
            rates.policy,
            args.episodes.episodes
        )?;
        say!(
            "| {} | success at the end | success at any time | final distance (m) |\n|---|---|---|---|",
            measured.factor()
        )?;
        for (value, end, any, distance) in rates.points() {
            say!("| {value} | {} | {} | {distance:.3} |", rate(end), rate(any))?;
        }
        for (name, at) in TIMES {
            say!("success at {name}: {}", sums(measured, at)?)?;
        }
        say!("")?;
    }
    for pair in pairs {
        let [rows, columns] = &pair.factors;
        say!("{}, {}, success at the end; 95 % intervals", args.env_id, pair.rows[0].policy)?;
        let head: String = columns.values.iter().map(|value| format!(" {value} |")).collect();
        let rule = "---|".repeat(columns.values.len());
        say!("| {} \\ {} |{head}\n|---|{rule}", rows.factor, columns.factor)?;
        for (value, row) in rows.values.iter().zip(&pair.rows) {
            let cells = row.end.iter().map(|(_, end)| format!(" {} |", rate(*end)));
            say!("| {value} |{}", cells.collect::<String>())?;
        }
        say!("")?;
    }
    Ok(())
}

/// Returns what sums the curves of a policy up, or the mean over several.
pub fn sums(measured: &Measured, at: SuccessAt) -> anyhow::Result<String> {
    let rates = Rates::of(measured)?;
    let critical = match rates.critical(at) {
        Some(value) => format!("below {CRITICAL} at {value}"),
        None => format!("never below {CRITICAL}"),
    };
    // One value has neither a slope nor an area.
    if rates.end.len() < 2 {
        return Ok(critical);
    }
    let slope = measured.mean(|curve| curve.slope(at));
    let areas: Vec<_> = measured.curves.iter().map(|(_, curve)| curve.area(at)).collect();
    let area = match areas[..] {
        [area] => format!("{area:.4}"),
        _ => {
            let Estimate { value, low, high } = Estimate::mean(&areas)?;
            format!("{value:.4} ({low:.4} to {high:.4})")
        }
    };
    Ok(format!("{critical}, slope {slope:.3}, area {area}"))
}

/// Returns a rate and its interval.
pub fn rate(rate: Estimate) -> String {
    format!("{:.2} ({:.2} to {:.2})", rate.value, rate.low, rate.high)
}

/// Returns all curves, a line for each value: of each policy, and after those of a folder their
/// mean.
pub fn csv(measured: &[Measured]) -> anyhow::Result<String> {
    let mut text = "policy,factor,value,success_rate,success_rate_low,success_rate_high,\
                    success_any_rate,success_any_rate_low,success_any_rate_high,final_distance\n"
        .to_owned();
    for measured in measured {
        for rates in curves(measured)? {
            for (value, end, any, distance) in rates.points() {
                writeln!(
                    text,
                    "{},{},{value},{},{},{},{},{},{},{distance}",
                    quoted(&rates.policy),
                    quoted(measured.factor()),
                    end.value,
                    end.low,
                    end.high,
                    any.value,
                    any.low,
                    any.high,
                )?;
            }
        }
    }
    Ok(text)
}

/// Returns the figures of each policy, and then of the mean, if there are several.
fn curves(measured: &Measured) -> anyhow::Result<Vec<Rates>> {
    let each = measured.curves.iter().map(|(policy, curve)| Rates::of_one(policy, curve));
    let mut all: Vec<_> = each.collect();
    if all.len() > 1 {
        let policy = measured.policy.clone();
        all.push(Rates { policy, ..Rates::of(measured)? });
    }
    Ok(all)
}

/// Returns a field as CSV has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

/// Returns all figures, with their names.
pub fn figures(measured: &[Measured], pairs: &[Pair]) -> anyhow::Result<Vec<(String, Metric)>> {
    let mut figures = Vec::new();
    for measured in measured {
        figures.extend(figures_of_curves(measured)?);
    }
    for pair in pairs {
        let [rows, columns] = &pair.factors;
        let names = rows.each().flat_map(|(row, value)| {
            columns.each().map(move |(column, other)| format!("{row}={value}/{column}={other}"))
        });
        for (name, cell) in names.zip(pair.cells()) {
            figures.extend(rates(&format!("robustness/{}/{name}", pair.policy), cell));
        }
    }
    Ok(figures)
}

/// Returns the figures of the success rates at the end and at any time.
pub fn rates(name: &str, [end, any]: [Estimate; 2]) -> [(String, Metric); 2] {
    [("success_rate", end), ("success_any_rate", any)]
        .map(|(figure, rate)| (format!("{name}/{figure}"), Metric::new(rate.value, "1")))
}

fn figures_of_curves(measured: &Measured) -> anyhow::Result<Vec<(String, Metric)>> {
    let mut figures = Vec::new();
    for of_one in curves(measured)? {
        let name = format!("robustness/{}/{}", of_one.policy, measured.factor());
        for (value, end, any, _) in of_one.points() {
            figures.extend(rates(&format!("{name}/{value}"), [end, any]));
        }
    }
    let rates = Rates::of(measured)?;
    for (at, suffix) in [(SuccessAt::End, "success_rate"), (SuccessAt::AnyTime, "success_any_rate")]
    {
        let name = format!("robustness/{}/{}/{suffix}", measured.policy, measured.factor());
        let mut push =
            |figure, value| figures.push((format!("{name}/{figure}"), Metric::new(value, "1")));
        push("area", measured.mean(|curve| curve.area(at)));
        push("slope", measured.mean(|curve| curve.slope(at)));
        if let Some(value) = rates.critical(at) {
            push("critical", value);
        }
    }
    figures.retain(|(_, figure)| figure.value.is_finite());
    Ok(figures)
}
