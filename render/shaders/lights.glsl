// lights.glsl - the lights, in the shape's coordinates: the scene's, then the environment's.
layout(std140) uniform Lights {
    vec4 light_at[MAX_LIGHTS];    // xyz: position; direction where w is 0
    vec4 light_power[MAX_LIGHTS]; // rgb: intensity or irradiance
};
uniform int n_lights;
flat in ivec2 far_list; // first and number of the environment's lights that can matter here
