// mesh.glsl - vertex shader of meshes, in the mesh's coordinates; row 0 of the target is on top.
layout(location = 0) in vec3 at;
layout(location = 1) in vec3 n;
layout(location = 2) in vec3 t;
layout(location = 3) in vec2 st;
uniform vec3 eye, right, up, forward;
uniform vec2 shift;
uniform int n_far;
flat out ivec2 far_list;
out vec3 mesh_at, mesh_n, mesh_t;
out vec2 mesh_st;

void main()
{
    far_list = ivec2(0, n_far);
    mesh_at = at;
    mesh_n = n;
    mesh_t = t;
    mesh_st = st;
    vec3 p = at - eye;
    // The fragment shader writes the depth; z = 0 only keeps what is in front of the eye.
    float z = dot(p, forward);
    vec2 xy = vec2(dot(p, right) / dot(right, right), -dot(p, up) / dot(up, up)) - shift * z;
    gl_Position = vec4(xy, 0.0, z);
}
