//! Comma-separated values: no word in them has a comma or a quote.

use coloc_shm_types::Estimate;

use super::reading::Reading;

pub(super) const HEADING: &str = "session,sequence,tick,clock,stamp_ns,boot_ns,x_m,y_m,heading_rad,\
    sigma_x_m,sigma_y_m,sigma_heading_rad,vx_mps,vy_mps,omega_radps,state,fit,\
    odometry_health,relative_pose_health,position_health,neighbour_health,pose_health,\
    odometry_x_m,odometry_y_m,odometry_heading_rad,unfit,heading_health,gyro_health,\
    gyro_bias_radps,sigma_gyro_bias_radps,opinion";

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
        odometry_health,
        relative_pose_health,
        position_health,
        neighbour_health,
        pose_health,
        odometry_x_m,
        odometry_y_m,
        odometry_heading_rad,
        unfit,
        heading_health,
        gyro_health,
        gyro_bias_radps,
        sigma_gyro_bias_radps,
        opinion,
    } = Reading::of(estimate);
    format!(
        "{session},{sequence},{tick},{clock},{stamp_ns},{boot_ns},{x_m},{y_m},{heading_rad},\
         {sigma_x_m},{sigma_y_m},{sigma_heading_rad},{vx_mps},{vy_mps},{omega_radps},{state},{fit},\
         {odometry_health},{relative_pose_health},{position_health},{neighbour_health},{pose_health},\
         {odometry_x_m},{odometry_y_m},{odometry_heading_rad},{unfit},{heading_health},{gyro_health},\
         {gyro_bias_radps},{sigma_gyro_bias_radps},{opinion}"
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use coloc_shm_types::{Input, RobotName};
    use serde_json::{Map, Value};

    use super::super::json;
    use super::super::reading::example;
    use super::*;

    /// Who reads `pose` beside `x_m` takes it for one.
    #[test]
    fn no_column_of_words_has_the_name_of_a_quantity() {
        for column in HEADING.split(',') {
            let is_input = Input::ALL.iter().any(|input| input.name() == column);
            assert!(!is_input, "{column}");
        }
    }

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
