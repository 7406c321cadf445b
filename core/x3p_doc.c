// x3p_doc.c - the XML document of an X3P file, through expat.
#define _GNU_SOURCE
#include "core/mem.h"
#include "core/meta_text.h"
#include "core/x3p.h"
#include <expat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct parse {
    XML_Parser xml;
    struct x3p_doc *doc;
    char path[256];  // "Record1/Axes/CX/Increment", without the root and namespaces
    int depth, lost; // lost: depth of elements that the path did not hold
    bool too_long, has_doctype;
};

static const struct {
    const char *path;
    size_t at, size;
} fields[] = {
#define FIELD(path, name)                                                                          \
    {                                                                                              \
        path, offsetof(struct x3p_doc, name), sizeof((struct x3p_doc *)0)->name                    \
    }
    FIELD("Record1/FeatureType", feature),
    FIELD("Record1/Axes/CX/AxisType", x_axis),
    FIELD("Record1/Axes/CY/AxisType", y_axis),
    FIELD("Record1/Axes/CZ/AxisType", z_axis),
    FIELD("Record1/Axes/CX/Increment", dx),
    FIELD("Record1/Axes/CY/Increment", dy),
    FIELD("Record1/Axes/CZ/Increment", dz),
    FIELD("Record1/Axes/CX/Offset", x_offset),
    FIELD("Record1/Axes/CY/Offset", y_offset),
    FIELD("Record1/Axes/CZ/Offset", z_offset),
    FIELD("Record1/Axes/CZ/DataType", z_type),
    FIELD("Record2/Comment", comment),
    FIELD("Record3/MatrixDimension/SizeX", nx),
    FIELD("Record3/MatrixDimension/SizeY", ny),
    FIELD("Record3/MatrixDimension/SizeZ", nz),
    FIELD("Record3/DataLink/PointDataLink", data_link),
    FIELD("Record3/DataLink/MD5ChecksumPointData", data_md5),
    FIELD("Record3/DataLink/ValidPointsLink", valid_link),
    FIELD("Record3/DataLink/MD5ChecksumValidPoints", valid_md5),
    FIELD("Record4/ChecksumFile", checksum_link),
#undef FIELD
};

static const char *local_name(const char *name)
{
    const char *colon = strrchr(name, ':');
    return colon ? colon + 1 : name;
}

static void on_start(void *data, const char *name, const char **attributes)
{
    (void)attributes;
    struct parse *p = data;
    const size_t used = strlen(p->path);
    name = local_name(name);
    if (p->depth++ == 0)
        return; // the root
    if (p->lost || used + strlen(name) + 2 > sizeof p->path) {
        p->lost++;
        return;
    }
    snprintf(p->path + used, sizeof p->path - used, "%s%s", used ? "/" : "", name);
    if (!strcmp(p->path, "Record3/DataList"))
        p->doc->has_list = true;
}

static void on_end(void *data, const char *name)
{
    (void)name;
    struct parse *p = data;
    p->depth--;
    if (p->lost) {
        p->lost--;
        return;
    }
    char *slash = strrchr(p->path, '/');
    *(slash ? slash : p->path) = 0;
}

static void on_text(void *data, const char *text, int len)
{
    struct parse *p = data;
    for (size_t k = 0; k < sizeof fields / sizeof *fields && !p->lost; k++) {
        if (strcmp(p->path, fields[k].path))
            continue;
        char *to = (char *)p->doc + fields[k].at;
        const size_t used = strlen(to);
        if (used + (size_t)len >= fields[k].size)
            p->too_long |= to != p->doc->comment;
        else
            snprintf(to + used, fields[k].size - used, "%.*s", len, text);
    }
}

static void on_doctype(void *data, const char *name, const char *sys, const char *pub, int internal)
{
    (void)name;
    (void)sys;
    (void)pub;
    (void)internal;
    struct parse *p = data;
    p->has_doctype = true; // entities are a way to make a small file large
    XML_StopParser(p->xml, XML_FALSE);
}

static void trim(char *s)
{
    const size_t lead = strspn(s, " \t\r\n");
    memmove(s, s + lead, strlen(s + lead) + 1);
    for (size_t n = strlen(s); n && strchr(" \t\r\n", s[n - 1]); n--)
        s[n - 1] = 0;
}

bool x3p_doc_parse(struct x3p_doc *d, const char *xml, size_t size, struct err *e)
{
    struct parse p = {.xml = XML_ParserCreate(NULL), .doc = d};
    *d = (struct x3p_doc){0};
    if (!p.xml)
        return err_set(e, ERR_FILE, "no memory for main.xml");
    XML_SetUserData(p.xml, &p);
    XML_SetElementHandler(p.xml, on_start, on_end);
    XML_SetCharacterDataHandler(p.xml, on_text);
    XML_SetStartDoctypeDeclHandler(p.xml, on_doctype);
    bool ok = XML_Parse(p.xml, xml, (int)size, 1) == XML_STATUS_OK;
    if (p.has_doctype)
        err_set(e, ERR_DATA, "main.xml has a document type, which X3P does not allow");
    else if (!ok)
        err_set(e, ERR_DATA, "main.xml:%lu: %s", XML_GetCurrentLineNumber(p.xml),
                XML_ErrorString(XML_GetErrorCode(p.xml)));
    else if (p.too_long)
        ok = err_set(e, ERR_DATA, "main.xml: a value is too long");
    XML_ParserFree(p.xml);
    for (size_t k = 0; k < sizeof fields / sizeof *fields; k++)
        trim((char *)d + fields[k].at);
    return ok;
}

static void put_escaped(FILE *f, const char *text)
{
    for (const char *c = text; *c; c++) {
        if (*c == '&' || *c == '<' || *c == '>')
            fprintf(f, "&#%d;", *c);
        else if ((unsigned char)*c >= ' ')
            putc(*c, f);
    }
}

static void put_axis(FILE *f, const char *name, double increment, double offset)
{
    char a[NUMBER_TEXT], b[NUMBER_TEXT];
    fprintf(f,
            "      <%s>\n        <AxisType>I</AxisType>\n        <DataType>D</DataType>\n"
            "        <Increment>%s</Increment>\n        <Offset>%s</Offset>\n      </%s>\n",
            name, number_text(increment, a), number_text(offset, b), name);
}

char *x3p_doc_text(const struct hfield *hf, const char *data_md5)
{
    const struct meta_item *offset = meta_find(&hf->meta, "nacre.offset_m");
    const bool shifted = offset && offset->n == 2;
    char *text = NULL;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f)
        return xstrdup("");
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
          "<p:ISO5436_2 xmlns:p=\"http://www.opengps.eu/2008/ISO5436_2\">\n"
          "  <Record1>\n    <Revision>ISO5436 - 2000</Revision>\n"
          "    <FeatureType>SUR</FeatureType>\n    <Axes>\n",
          f);
    put_axis(f, "CX", hf->dx_m, shifted ? offset->num[0] : 0);
    put_axis(f, "CY", hf->dy_m, shifted ? offset->num[1] : 0);
    fputs("      <CZ>\n        <AxisType>A</AxisType>\n        <DataType>F</DataType>\n"
          "      </CZ>\n    </Axes>\n  </Record1>\n"
          // a date is required; the clock would make other bytes of the same input
          "  <Record2>\n    <Date>1970-01-01T00:00:00</Date>\n    <Instrument>\n"
          "      <Manufacturer>nacre</Manufacturer>\n      <Model>nacre</Model>\n"
          "      <Serial>not available</Serial>\n      <Version>" NACRE_VERSION "</Version>\n"
          "    </Instrument>\n    <CalibrationDate>1970-01-01T00:00:00</CalibrationDate>\n"
          "    <ProbingSystem>\n      <Type>Software</Type>\n"
          "      <Identification>not available</Identification>\n    </ProbingSystem>\n"
          "    <Comment>",
          f);
    for (int k = 0; k < hf->meta.n; k++) {
        if (hf->meta.item + k == offset)
            continue;
        char *value = meta_value_text(&hf->meta.item[k]);
        fputs("\n", f);
        put_escaped(f, hf->meta.item[k].key);
        fputs(" = ", f);
        put_escaped(f, value);
        free(value);
    }
    fprintf(f,
            "</Comment>\n  </Record2>\n  <Record3>\n    <MatrixDimension>\n"
            "      <SizeX>%d</SizeX>\n      <SizeY>%d</SizeY>\n      <SizeZ>1</SizeZ>\n"
            "    </MatrixDimension>\n    <DataLink>\n"
            "      <PointDataLink>bindata/data.bin</PointDataLink>\n"
            "      <MD5ChecksumPointData>%s</MD5ChecksumPointData>\n"
            "    </DataLink>\n  </Record3>\n  <Record4>\n"
            "    <ChecksumFile>md5checksum.hex</ChecksumFile>\n  </Record4>\n</p:ISO5436_2>\n",
            hf->nx, hf->ny, data_md5);
    fclose(f);
    return text;
}
