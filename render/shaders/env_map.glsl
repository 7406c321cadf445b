// A lat-long map as a target: w columns, h rows and one more beyond either pole.
uniform vec2 size; // w, h

// Direction of this pixel; the rows beyond the poles come out on the other side by themselves.
vec3 pixel_direction()
{
    float th = 3.14159265358979 * (gl_FragCoord.y - 1.0) / size.y;
    float ph = 6.28318530717959 * gl_FragCoord.x / size.x - 3.14159265358979;
    return vec3(sin(th) * sin(ph), cos(th), -sin(th) * cos(ph));
}

// Column and row of a direction, pixel centres at whole numbers.
vec2 pixel_of(vec3 d)
{
    float th = atan(length(d.xz), d.y), ph = atan(d.x, -d.z);
    return vec2((ph + 3.14159265358979) / 6.28318530717959 * size.x,
                th / 3.14159265358979 * size.y) - 0.5;
}
