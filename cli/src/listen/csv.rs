//! Comma-separated values: no word in them has a comma or a quote.

use coloc_shm_types::Estimate;

use super::reading::Reading;

pub(super) const HEADING: &str = "session,sequence,tick,clock,stamp_ns,boot_ns,x_m,y_m,heading_rad,\
    sigma_x_m,sigma_y_m,sigma_heading_rad,vx_mps,vy_mps,omega_radps,state,fit,odometry,relative_pose,position,neighbour,pose,\
    odometry_x_m,odometry_y_m,odometry_heading_rad,unfit,heading";

pub(super) fn line(estimate: &Estimate) -> String {
    let Reading {
        session,
        sequence,
        tick,
        clock,
        stamp_ns,
        boot_ns,
        x_m,
        y_m,
        heading_rad,
        sigma_x_m,
        sigma_y_m,
        sigma_heading_rad,
        vx_mps,
        vy_mps,
        omega_radps,
        state,
        fit,
        odometry,
        relative_pose,
        position,
        neighbour,
        pose,
        odometry_x_m,
        odometry_y_m,
        odometry_heading_rad,
        unfit,
        heading,
    } = Reading::of(estimate);
    format!(
        "{session},{sequence},{tick},{clock},{stamp_ns},{boot_ns},{x_m},{y_m},{heading_rad},\
         {sigma_x_m},{sigma_y_m},{sigma_heading_rad},{vx_mps},{vy_mps},{omega_radps},{state},{fit},\
         {odometry},{relative_pose},{position},{neighbour},{pose},\
         {odometry_x_m},{odometry_y_m},{odometry_heading_rad},{unfit},{heading}"
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use coloc_shm_types::RobotName;
    use serde_json::{Map, Value};

    use super::super::json;
    use super::super::reading::example;
    use super::*;

    /// As in JSON, apart from what is not a single value there.
    #[test]
    fn a_row_says_under_its_heading_what_the_object_says() {
        let robot = RobotName::new("r1").unwrap();
        let object: Map<String, Value> =
            serde_json::from_str(&json::line(&robot, &example())).unwrap();
        let line = line(&example());
        let row: BTreeMap<&str, &str> = HEADING.split(',').zip(line.split(',')).collect();
        assert_eq!(row.len(), line.split(',').count());
        assert_eq!(row.len() + 3, object.len());
        for (name, text) in row {
            let value = &object[name];
            let same = match value.as_f64() {
                Some(number) => text.parse() == Ok(number),
                None => value.to_string().trim_matches('"') == text,
            };
            assert!(same, "{name}: {text} is not {value}");
        }
    }
}
