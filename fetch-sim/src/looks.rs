//! How pictures of a scene may differ between episodes.

factors! {
    /// A number of how a scene looks that may differ between episodes.
    ///
    /// Looks change pictures and nothing else. The camera's are relative to the camera that takes
    /// the picture, in its own frame. A look of what the model lacks changes nothing.
    LookFactor {
        /// `object_color_red`: the red of the object's color, from 0 to 1.
        ObjectColorRed = "object_color_red", "object_color_red", [0.0, 1.0];
        /// `object_color_green`: the green of the object's color, from 0 to 1.
        ObjectColorGreen = "object_color_green", "object_color_green", [0.0, 1.0];
        /// `object_color_blue`: the blue of the object's color, from 0 to 1.
        ObjectColorBlue = "object_color_blue", "object_color_blue", [0.0, 1.0];
        /// `table_color_red`: the red of the table's color, from 0 to 1.
        TableColorRed = "table_color_red", "table_color_red", [0.0, 1.0];
        /// `table_color_green`: the green of the table's color, from 0 to 1.
        TableColorGreen = "table_color_green", "table_color_green", [0.0, 1.0];
        /// `table_color_blue`: the blue of the table's color, from 0 to 1.
        TableColorBlue = "table_color_blue", "table_color_blue", [0.0, 1.0];
        /// `floor_color_red`: the red of the floor's color, from 0 to 1.
        FloorColorRed = "floor_color_red", "floor_color_red", [0.0, 1.0];
        /// `floor_color_green`: the green of the floor's color, from 0 to 1.
        FloorColorGreen = "floor_color_green", "floor_color_green", [0.0, 1.0];
        /// `floor_color_blue`: the blue of the floor's color, from 0 to 1.
        FloorColorBlue = "floor_color_blue", "floor_color_blue", [0.0, 1.0];
        /// `goal_color_red`: the red of the goals' color, from 0 to 1.
        GoalColorRed = "goal_color_red", "goal_color_red", [0.0, 1.0];
        /// `goal_color_green`: the green of the goals' color, from 0 to 1.
        GoalColorGreen = "goal_color_green", "goal_color_green", [0.0, 1.0];
        /// `goal_color_blue`: the blue of the goals' color, from 0 to 1.
        GoalColorBlue = "goal_color_blue", "goal_color_blue", [0.0, 1.0];
        /// `goal_visible`: whether goals are drawn: 0 below 0.5, 1 otherwise.
        GoalVisible = "goal_visible", "goal_visible", [0.0, 1.0];
        /// `light_azimuth`: where the light comes from, as seen from above: degrees from the x axis,
        /// counterclockwise. A light from straight above has none.
        LightAzimuth = "light_azimuth", "light_azimuth, in degrees,", [-360.0, 360.0];
        /// `light_elevation`: the light's height above the horizon, in degrees. The built-in model's
        /// comes from straight above, 90.
        LightElevation = "light_elevation", "light_elevation, in degrees,", [-90.0, 90.0];
        /// `light_intensity`: the light's intensity, from 0 to 1. The built-in model's is 0.8. The
        /// lamp at the camera stays.
        LightIntensity = "light_intensity", "light_intensity", [0.0, 1.0];
        /// `camera_right`: displacement of the camera to its own right, in meters.
        CameraRight = "camera_right", "camera_right, in meters,", [-1e1, 1e1];
        /// `camera_up`: displacement of the camera along the upright of its picture, in meters.
        CameraUp = "camera_up", "camera_up, in meters,", [-1e1, 1e1];
        /// `camera_forward`: displacement of the camera in the direction in which it looks, in meters.
        CameraForward = "camera_forward", "camera_forward, in meters,", [-1e1, 1e1];
        /// `camera_pan`: turn of the camera to its left, in degrees.
        CameraPan = "camera_pan", "camera_pan, in degrees,", [-180.0, 180.0];
        /// `camera_tilt`: turn of the camera up, in degrees. It comes after the pan.
        CameraTilt = "camera_tilt", "camera_tilt, in degrees,", [-180.0, 180.0];
        /// `camera_field_of_view`: scale of the width and the height that the camera sees at any
        /// distance.
        CameraFieldOfView = "camera_field_of_view", "camera_field_of_view, a scale,", [0.1, 10.0];
    }
    /// How a scene looks, where that differs from the model.
    ///
    /// ```
    /// use fetch_sim::{LookFactor, Looks};
    ///
    /// let hidden = Looks::default().with(LookFactor::GoalVisible, 0.0)?;
    /// assert_eq!(hidden.get(LookFactor::GoalVisible), Some(0.0));
    /// # Ok::<(), fetch_sim::SimError>(())
    /// ```
    Looks
}

impl LookFactor {
    /// The object's red, green and blue.
    pub const OBJECT_COLOR: [Self; 3] =
        [Self::ObjectColorRed, Self::ObjectColorGreen, Self::ObjectColorBlue];
    /// The table's red, green and blue.
    pub const TABLE_COLOR: [Self; 3] =
        [Self::TableColorRed, Self::TableColorGreen, Self::TableColorBlue];
    /// The floor's red, green and blue.
    pub const FLOOR_COLOR: [Self; 3] =
        [Self::FloorColorRed, Self::FloorColorGreen, Self::FloorColorBlue];
    /// The goals' red, green and blue.
    pub const GOAL_COLOR: [Self; 3] =
        [Self::GoalColorRed, Self::GoalColorGreen, Self::GoalColorBlue];
}
