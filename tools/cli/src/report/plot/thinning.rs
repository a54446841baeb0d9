//! No more points than pixels can show.

/// Keeps, of the points that fall on one column of pixels, the first, the lowest, the highest and the last,
/// so that the picture is that of all points. Cuts the line where a value is missing.
pub(super) fn thinned(points: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<Vec<(f64, f64)>> {
    let mut stretches = vec![Vec::new()];
    let mut column: Vec<(f64, f64)> = Vec::new();
    for (x, y) in points {
        // Half pixels: up to 1648 columns.
        let same = column.first().is_some_and(|(first, _)| (2.0 * first).floor() == (2.0 * x).floor());
        if !same || y.is_none() {
            flush(&mut column, &mut stretches);
        }
        match y {
            Some(y) => column.push((x, y)),
            None if stretches.last().is_some_and(|stretch| !stretch.is_empty()) => stretches.push(Vec::new()),
            None => {}
        }
    }
    flush(&mut column, &mut stretches);
    stretches.retain(|stretch| !stretch.is_empty());
    stretches
}

fn flush(column: &mut Vec<(f64, f64)>, stretches: &mut [Vec<(f64, f64)>]) {
    let Some(stretch) = stretches.last_mut() else { return };
    if column.len() <= 4 {
        stretch.append(column);
        return;
    }
    let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let corners = [column.first(), column.iter().min_by(by_y), column.iter().max_by(by_y), column.last()];
    let mut kept: Vec<(f64, f64)> = corners.into_iter().flatten().copied().collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept.dedup();
    stretch.append(&mut kept);
    column.clear();
}
