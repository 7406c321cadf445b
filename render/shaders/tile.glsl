// tile.glsl - vertex shader: rectangles of the target, two triangles each.
layout(location = 0) in vec4 tile; // x0, y0, x1, y1 in pixels
layout(location = 1) in ivec2 lights;
uniform vec2 size;
flat out ivec2 far_list;

void main()
{
    far_list = lights;
    vec2 at = vec2((gl_VertexID & 1) == 0 ? tile.x : tile.z, gl_VertexID < 2 ? tile.y : tile.w);
    gl_Position = vec4(2.0 * at / size - 1.0, 0.0, 1.0);
}
