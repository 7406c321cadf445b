// backdrop.glsl - fragment shader: the environment behind the objects.
uniform vec2 size, shift;
uniform vec3 right, up, forward; // of the camera, in the world
out vec4 color;

void main()
{
    vec2 at = 2.0 * gl_FragCoord.xy / size - 1.0 + shift;
    color = vec4(surround_radiance(forward + at.x * right - at.y * up), 1.0);
}
